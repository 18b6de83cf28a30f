// SPDX-License-Identifier: MIT
#include "lecalib/host/simulator_scene.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib::host {
namespace {

struct Bounds {
  Vec3 low, high;
  [[nodiscard]] Vec3 size() const { return high - low; }
  [[nodiscard]] Vec3 center() const { return 0.5 * (low + high); }
};

Bounds bounds_of(const Model& model) {
  Bounds b{Vec3::Constant(1e300), Vec3::Constant(-1e300)};
  for (const ModelLine& line : model.lines) {
    for (const Vec3& end : {Vec3(line.p), Vec3(line.q)}) {
      b.low = b.low.cwiseMin(end);
      b.high = b.high.cwiseMax(end);
    }
  }
  return b;
}

Figure rectangle(double u, double v, double width, double height, float radiance) {
  return {{{u, v}, {u + width, v}, {u + width, v + height}, {u, v + height}}, radiance};
}

/// A strip of the given width whose centre line runs from a to b.
Figure strip(const Vec2& a, const Vec2& b, double width, float radiance) {
  const Vec2 along = (b - a).normalized() * (0.5 * width);
  const Vec2 left(-along(1), along(0));
  return {{a - along - left, b + along - left, b + along + left, a - along + left}, radiance};
}

/// A wide face around `center` that the target lies on or stands before.
Face board(const Vec3& center, const Vec3& u, const Vec3& v, double width, double height, float radiance) {
  return {center - 0.5 * width * u - 0.5 * height * v, u, v, width, height, radiance, {}};
}

/// Rows of print: bars of uneven length, with gaps between words.
void add_print(Face* face, double u, double v, double width, double height, int rows) {
  constexpr double kWords[] = {0.21, 0.34, 0.13, 0.27, 0.18};
  const double pitch = height / rows;
  for (int row = 0; row < rows; ++row) {
    double at = 0.0;
    for (int word = row % 3; word < row % 3 + 3; ++word) {
      const double length = kWords[word] * (row % 4 == 3 ? 0.8 : 1.0);
      face->figures.push_back(
          rectangle(u + at * width, v + (rows - 1 - row) * pitch, length * width, 0.4 * pitch, 0.12F));
      at += length + 0.05;
    }
  }
}

/// A white label with a bar code, [u, u + width] x [v, v + height].
void add_label(Face* face, double u, double v, double width, double height) {
  face->figures.push_back(rectangle(u, v, width, height, 0.85F));
  constexpr double kBars[] = {0.10, 0.16, 0.27, 0.33, 0.46, 0.57, 0.62, 0.74, 0.84};
  for (const double bar : kBars) {
    face->figures.push_back(rectangle(u + bar * width, v + 0.12 * height, 0.04 * width, 0.35 * height, 0.10F));
  }
  face->figures.push_back(rectangle(u + 0.10 * width, v + 0.62 * height, 0.55 * width, 0.10 * height, 0.25F));
  face->figures.push_back(rectangle(u + 0.10 * width, v + 0.80 * height, 0.70 * width, 0.06 * height, 0.25F));
}

/// The shadow on the floor (u = x, v = y from the floor's origin) of a box in light from the front left: the hull of
/// its base and its displaced top.
Figure box_shadow(const Bounds& b, const Vec3& floor_origin) {
  const Vec2 low = (b.low - floor_origin).head<2>();
  const Vec2 high = (b.high - floor_origin).head<2>();
  const Vec2 shift = b.size()(2) * Vec2(0.45, 0.8);
  return {{low,
           {high(0), low(1)},
           Vec2(high(0), low(1)) + shift,
           high + shift,
           Vec2(low(0), high(1)) + shift,
           {low(0), high(1)}},
          0.055F};
}

/// A floor and two walls behind the target, in this order.
void add_room(const Bounds& b, Scene* scene) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const double size = b.size().maxCoeff();
  const double side = 12.0 * size;
  const Vec3 corner = Vec3(b.center()(0) + 2.5 * size, b.center()(1) + 2.2 * size, b.low(2));  // of floor and two walls
  Face floor{corner - side * x - side * y, x, y, side, side, 0.12F, {}};
  Face back{corner - side * x, x, z, side, 0.7 * side, 0.66F, {}};
  back.figures.push_back(rectangle(0.0, 0.0, side, 0.18 * size, 0.30F));  // skirting
  back.figures.push_back(rectangle(side - 1.8 * size, 0.75 * size, 0.9 * size, 0.6 * size, 0.21F));
  Face right{corner, -y, z, side, 0.7 * side, 0.40F, {}};
  right.figures.push_back(rectangle(0.0, 0.0, side, 0.18 * size, 0.22F));
  for (Face* face : {&floor, &back, &right}) scene->faces.push_back(std::move(*face));
}

Scene box_scene(const Model& model) {
  const Bounds b = bounds_of(model);
  const double w = b.size()(0), h = b.size()(1), d = b.size()(2);
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  Face front{b.low, x, z, w, d, 0.60F, {}};
  add_label(&front, 0.55 * w, 0.30 * d, 0.30 * w, 0.45 * d);
  Face side{b.low + h * y, -y, z, h, d, 0.21F, {}};
  side.figures.push_back(rectangle(0.45 * h, 0.22 * d, 0.25 * h, 0.28 * d, 0.50F));
  Face top{b.low + d * z, x, y, w, h, 0.37F, {}};
  top.figures.push_back(rectangle(0.0, 0.44 * h, w, 0.12 * h, 0.47F));  // tape along the flaps
  add_print(&top, 0.10 * w, 0.62 * h, 0.35 * w, 0.25 * h, 3);
  Face right{b.low + w * x, y, z, h, d, 0.30F, {}};
  Face back{b.high - d * z, -x, z, w, d, 0.25F, {}};
  Scene scene;
  for (Face* face : {&front, &side, &top, &right, &back}) scene.faces.push_back(std::move(*face));
  scene.target_faces = scene.faces.size();
  add_room(b, &scene);
  Face& floor = scene.faces[scene.target_faces];
  floor.figures.push_back(box_shadow(b, floor.origin));
  scene.view_from = Vec3(-0.56, -0.62, 0.55).normalized();
  scene.up = z;
  return scene;
}

Scene rectangle_scene(const Model& model) {
  const Bounds b = bounds_of(model);
  const double w = b.size()(0), h = b.size()(1), size = b.size().maxCoeff();
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  Scene scene;
  Face sheet{b.low, x, y, w, h, 0.80F, {}};
  add_print(&sheet, 0.15 * w, 0.15 * h, 0.6 * w, 0.55 * h, 9);
  sheet.figures.push_back(rectangle(0.15 * w, 0.80 * h, 0.3 * w, 0.08 * h, 0.30F));
  Face table = board(b.center(), x, y, 9.0 * size, 9.0 * size, 0.17F);
  const Vec2 middle = Vec2::Constant(4.5 * size);
  table.figures.push_back(
      strip(middle + size * Vec2(0.95, -0.45), middle + size * Vec2(1.2, 0.35), 0.05 * size, 0.55F));  // a pen
  table.figures.push_back(rectangle(0.0, 5.8 * size, 9.0 * size, 3.2 * size, 0.32F));                  // table's end
  scene.faces.push_back(std::move(sheet));
  scene.target_faces = 1;
  scene.faces.push_back(std::move(table));
  scene.view_from = Vec3(-0.25, -0.50, 0.83).normalized();
  scene.up = y;
  return scene;
}

/// The squares follow from the model's rows and columns: its lines along x and along y.
Scene checkerboard_scene(const Model& model) {
  const Bounds b = bounds_of(model);
  std::vector<double> xs, ys;
  for (const ModelLine& line : model.lines) {
    if (line.p[0] == line.q[0]) xs.push_back(line.p[0]);
    if (line.p[1] == line.q[1]) ys.push_back(line.p[1]);
  }
  std::sort(xs.begin(), xs.end());
  std::sort(ys.begin(), ys.end());
  const double square = xs[1] - xs[0];
  Scene scene;
  // Seen from z < 0 the rows run downwards, as OpenCV counts them: u = x, v = -y.
  const Vec3 u = Vec3::UnitX(), v = -Vec3::UnitY();
  const Vec3 size = b.size();
  Face sheet = board(b.center(), u, v, size(0) + 2 * square, size(1) + 2 * square, 0.78F);
  for (std::size_t r = 0; r + 1 < ys.size(); ++r) {
    for (std::size_t c = r % 2; c + 1 < xs.size(); c += 2) {
      const Vec3 corner = Vec3(xs[c], ys[r + 1], b.low(2)) - sheet.origin;
      sheet.figures.push_back(rectangle(corner.dot(u), corner.dot(v), square, square, 0.12F));
    }
  }
  scene.faces.push_back(std::move(sheet));
  scene.target_faces = 1;
  const double extent = size.maxCoeff();
  scene.faces.push_back(board(b.center() + extent * Vec3::UnitZ(), u, v, 9 * extent, 9 * extent, 0.35F));
  scene.view_from = Vec3(-0.30, 0.35, -0.85).normalized();
  scene.up = v;
  return scene;
}

/// Strips and rods are this part of the model's extent wide: about two pixels when the model fills the image.
constexpr double kLineWidth = 1.0 / 120.0;

/// Unit normal of the plane that holds all end points, or zero.
Vec3 common_normal(const Model& model, double extent) {
  const Vec3 origin(model.lines[0].p);
  const Vec3 along = (Vec3(model.lines[0].q) - origin).normalized();
  Vec3 normal = Vec3::Zero();
  for (const ModelLine& line : model.lines) {
    for (const Vec3& end : {Vec3(line.p), Vec3(line.q)}) {
      const Vec3 n = along.cross(end - origin);
      if (n.norm() > normal.norm()) normal = n;
    }
  }
  if (normal.norm() < 1e-6 * extent) return Vec3::Zero();
  normal.normalize();
  for (const ModelLine& line : model.lines) {
    for (const Vec3& end : {Vec3(line.p), Vec3(line.q)}) {
      if (std::abs(normal.dot(end - origin)) > 1e-4 * extent) return Vec3::Zero();
    }
  }
  return normal;
}

Scene planar_scene(const Model& model, const Vec3& normal) {
  const Bounds b = bounds_of(model);
  const double extent = b.size().norm();
  // v is as upright as the plane allows: z, or y for a plane that lies flat.
  const Vec3 upright = std::abs(normal(2)) < 0.9 ? Vec3::UnitZ() : Vec3::UnitY();
  const Vec3 v = (upright - upright.dot(normal) * normal).normalized();
  const Vec3 u = v.cross(normal);
  Scene scene;
  Face sheet = board(b.center(), u, v, 6 * extent, 6 * extent, 0.60F);
  for (const ModelLine& line : model.lines) {
    const Vec3 p = Vec3(line.p) - sheet.origin, q = Vec3(line.q) - sheet.origin;
    sheet.figures.push_back(strip({p.dot(u), p.dot(v)}, {q.dot(u), q.dot(v)}, kLineWidth * extent, 0.12F));
  }
  scene.faces.push_back(std::move(sheet));
  scene.target_faces = 1;
  scene.view_from = (normal - 0.3 * u - 0.45 * v).normalized();
  scene.up = v;
  return scene;
}

Scene rod_scene(const Model& model) {
  const Bounds b = bounds_of(model);
  const double extent = b.size().norm();
  Scene scene;
  for (const ModelLine& line : model.lines) {
    scene.rods.push_back({Vec3(line.p), Vec3(line.q), 0.5 * kLineWidth * extent, 0.06F});
  }
  add_room(b, &scene);
  scene.faces.front().radiance = 0.48F;  // dark rods would not show on the dark floor
  scene.view_from = Vec3(-0.56, -0.62, 0.55).normalized();
  scene.up = Vec3::UnitZ();
  return scene;
}

}  // namespace

Result<Scene> make_scene(std::string_view target, const Model& model) {
  if (model.lines.size() < kMinModelLines) return Error{"a scene needs a model of four lines or more"};
  const std::string_view kind = target.substr(0, target.find(':'));
  Scene scene;
  if (kind == "box") {
    scene = box_scene(model);
  } else if (kind == "rectangle") {
    scene = rectangle_scene(model);
  } else if (kind == "checkerboard") {
    scene = checkerboard_scene(model);
  } else {
    const Vec3 normal = common_normal(model, bounds_of(model).size().norm());
    scene = normal.isZero() ? rod_scene(model) : planar_scene(model, normal);
  }
  scene.center = bounds_of(model).center();
  return scene;
}

}  // namespace lecalib::host
