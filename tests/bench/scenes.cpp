// SPDX-License-Identifier: MIT
#include "bench/scenes.hpp"

#include <algorithm>
#include <cmath>

#include "support/moving_edges.hpp"

namespace lecalib::bench {
namespace {

constexpr double kFocal = 400, kCentreX = 319.5, kCentreY = 239.5;  // px
constexpr double kNear = 5, kFar = 10;                              // m
constexpr double kTurn = 1;                                         // rad/s
constexpr double kSpeed = 1;                                        // m/s, along x and along y
constexpr double kMargin = 10;                                      // px that lines keep from the image's border
constexpr double kMinLength = 100;                                  // px
constexpr int kCurvePoints = 33;
constexpr float kTravel = 5;  // px in x and y, of the edges that no camera sees
constexpr double kPi = 3.14159265358979323846;

struct Point {
  double x, y, z;
};

/// A plane in front of the camera whose depth runs from kNear to kFar across the image: on a plane the inverse depth is
/// an affine function of the image's coordinates.
class Plane {
 public:
  explicit Plane(Rng* rng) {
    const double direction = rng->uniform(0, 2 * kPi);
    const double reach = std::fabs(std::cos(direction)) * kCentreX + std::fabs(std::sin(direction)) * kCentreY;
    const double slope = 0.5 * (1 / kNear - 1 / kFar) / reach;
    slope_x_ = slope * std::cos(direction);
    slope_y_ = slope * std::sin(direction);
  }
  [[nodiscard]] Point at(const Pixel& p) const {
    const double dx = p.x - kCentreX;
    const double dy = p.y - kCentreY;
    const double z = 1 / (0.5 * (1 / kNear + 1 / kFar) + slope_x_ * dx + slope_y_ * dy);
    return {dx / kFocal * z, dy / kFocal * z, z};
  }

 private:
  double slope_x_, slope_y_;
};

/// A segment in space and how it is seen.
class Line {
 public:
  Line(const Point& p, const Point& q, const ClusterOptions& options)
      : p_(p), q_(q), k1_(options.k1), k2_(options.k2) {}

  /// Image of the point at `s` (0 to 1) along the line, at `t` seconds.
  [[nodiscard]] Pixel seen(double s, double t) const {
    const Point at = {p_.x + s * (q_.x - p_.x), p_.y + s * (q_.y - p_.y), p_.z + s * (q_.z - p_.z)};
    const double c = std::cos(kTurn * t);
    const double n = std::sin(kTurn * t);
    const double x = (c * at.x - n * at.y + kSpeed * t) / at.z;
    const double y = (n * at.x + c * at.y + kSpeed * t) / at.z;
    const double r2 = x * x + y * y;
    const double factor = 1 + r2 * (k1_ + r2 * k2_);
    return {kCentreX + kFocal * x * factor, kCentreY + kFocal * y * factor};
  }
  [[nodiscard]] Curve curve(double t) const {
    Curve curve;
    for (int i = 0; i < kCurvePoints; ++i) curve.push_back(seen(i / (kCurvePoints - 1.0), t));
    return curve;
  }

 private:
  Point p_, q_;
  double k1_, k2_;
};

double length_of(const Curve& curve) {
  return std::hypot(curve.back().x - curve.front().x, curve.back().y - curve.front().y);
}

bool is_inside(const Curve& curve, const Scene& scene) {
  return std::all_of(curve.begin(), curve.end(), [&](const Pixel& p) {
    return p.x >= kMargin && p.y >= kMargin && p.x <= scene.width - 1 - kMargin && p.y <= scene.height - 1 - kMargin;
  });
}

/// Whether nobody could tell the two apart: nearly parallel, and the middle of one beside the other.
bool is_alike(const Curve& a, const Curve& b) {
  const auto beside = [](const Curve& line, const Curve& other) {
    const double ux = (line.back().x - line.front().x) / length_of(line);
    const double uy = (line.back().y - line.front().y) / length_of(line);
    const double turn =
        ((other.back().y - other.front().y) * ux - (other.back().x - other.front().x) * uy) / length_of(other);
    const Pixel& middle = other[other.size() / 2];
    const double dx = middle.x - line.front().x;
    const double dy = middle.y - line.front().y;
    const double along = dx * ux + dy * uy;
    return std::fabs(turn) < 0.05 && std::fabs(dy * ux - dx * uy) < 10 && along > -10 && along < length_of(line) + 10;
  };
  return beside(a, b) || beside(b, a);
}

std::vector<Line> make_lines(const ClusterOptions& options, double length_s, Rng* rng, Scene* scene) {
  const Plane plane(rng);
  std::vector<Line> lines;
  while (lines.size() < options.lines) {
    Pixel ends[2];
    for (Pixel& end : ends) {
      end.x = rng->uniform(0, scene->width - 1);
      end.y = rng->uniform(0, scene->height - 1);
    }
    const Line line(plane.at(ends[0]), plane.at(ends[1]), options);
    const TrueLine seen = {line.curve(0), line.curve(length_s)};
    if (length_of(seen.begin) < kMinLength || !is_inside(seen.begin, *scene) || !is_inside(seen.end, *scene)) continue;
    const bool is_new = std::none_of(scene->lines.begin(), scene->lines.end(),
                                     [&](const TrueLine& other) { return is_alike(seen.begin, other.begin); });
    if (!is_new) continue;
    lines.push_back(line);
    scene->lines.push_back(seen);
  }
  return lines;
}

/// Rounded to a pixel; left out beside the sensor.
void push(const Pixel& p, double t_us, std::uint8_t polarity, Scene* scene) {
  const double x = std::floor(p.x + 0.5);
  const double y = std::floor(p.y + 0.5);
  if (x < 0 || y < 0 || x >= scene->width || y >= scene->height) return;
  scene->events.push_back(
      {static_cast<std::int64_t>(t_us), static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), polarity});
}

void push_noise(std::size_t events, Rng* rng, Scene* scene) {
  for (std::size_t i = 0; i < events; ++i) {
    const double t_us = rng->uniform(0, static_cast<double>(scene->length_us));
    const double x = rng->uniform(0, scene->width - 1);
    const double y = rng->uniform(0, scene->height - 1);
    const auto polarity = static_cast<std::uint8_t>(rng->below(2));
    push({x, y}, t_us, polarity, scene);
  }
}

void sort_by_time(Scene* scene) {
  std::stable_sort(scene->events.begin(), scene->events.end(),
                   [](const Event& a, const Event& b) { return a.t_us < b.t_us; });
}

/// As it is at the window's end.
Segment moved(const Segment& s) { return {s.x1 + kTravel, s.y1 + kTravel, s.x2 + kTravel, s.y2 + kTravel}; }

test::SceneOptions edge_options(const Scene& scene, double events_per_px) {
  test::SceneOptions options;
  options.width = scene.width;
  options.height = scene.height;
  options.begin_us = 0;
  options.length_us = scene.length_us;
  options.events_per_px = events_per_px;
  return options;
}

}  // namespace

Scene make_cluster(const ClusterOptions& options) {
  Scene scene;
  scene.name = std::to_string(options.lines) + " lines";
  Rng rng(options.seed);
  const double length_s = 1e-6 * static_cast<double>(scene.length_us);
  const std::vector<Line> lines = make_lines(options, length_s, &rng, &scene);
  double sum_px = 0;
  for (const TrueLine& line : scene.lines) sum_px += length_of(line.begin);
  const auto on_lines = static_cast<double>(options.events) * (1 - options.noise_share);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto polarity = static_cast<std::uint8_t>(rng.below(2));
    const auto count = static_cast<std::size_t>(on_lines * length_of(scene.lines[i].begin) / sum_px);
    for (std::size_t k = 0; k < count; ++k) {
      const double s = rng.uniform();
      const double t_s = rng.uniform(0, length_s);
      Pixel p = lines[i].seen(s, t_s);
      p.x += options.sigma_px * test::normal(&rng);
      p.y += options.sigma_px * test::normal(&rng);
      push(p, 1e6 * t_s, polarity, &scene);
    }
  }
  push_noise(options.events > scene.events.size() ? options.events - scene.events.size() : 0, &rng, &scene);
  sort_by_time(&scene);
  return scene;
}

Scene make_texture(std::size_t events) {
  Scene scene;
  scene.name = "texture";
  Rng rng(1);
  push_noise(events, &rng, &scene);
  sort_by_time(&scene);
  return scene;
}

Scene make_pixels_in_turn(std::size_t events) {
  Scene scene;
  scene.name = "pixels in turn";
  const std::size_t pixels = std::size_t{scene.width} * scene.height;
  for (std::size_t i = 0; i < events; ++i) {
    const std::size_t pixel = i % pixels;
    const auto t_us = static_cast<double>(scene.length_us) * static_cast<double>(i) / static_cast<double>(events);
    push({static_cast<double>(pixel % scene.width), static_cast<double>(pixel / scene.width)}, t_us, 1, &scene);
  }
  return scene;
}

Scene make_short_edges(std::size_t events) {
  constexpr int kEdges = 1500;
  constexpr double kLength = 24;
  Scene scene;
  scene.name = "short edges";
  Rng rng(1);
  std::vector<test::MovingEdge> edges;
  for (int i = 0; i < kEdges; ++i) {
    const double x = rng.uniform(0, scene.width - kLength);
    const double y = rng.uniform(0, scene.height - kLength);
    const double direction = rng.uniform(0, kPi);
    const auto polarity = static_cast<std::uint8_t>(rng.below(2));
    const Segment begin = {static_cast<float>(x), static_cast<float>(y),
                           static_cast<float>(x + kLength * std::cos(direction)),
                           static_cast<float>(y + kLength * std::sin(direction))};
    edges.push_back({begin, moved(begin), polarity});
  }
  scene.events = test::make_events(edges, edge_options(scene, static_cast<double>(events) / (kEdges * kLength)));
  return scene;
}

Scene make_dense_grid(std::size_t events) {
  constexpr int kStep = 16;
  Scene scene;
  scene.name = "grid of edges";
  std::vector<test::MovingEdge> edges;
  double sum_px = 0;
  const auto add = [&](float x1, float y1, float x2, float y2) {
    const Segment begin = {x1, y1, x2, y2};
    edges.push_back({begin, moved(begin), static_cast<std::uint8_t>(edges.size() % 2)});
    sum_px += std::hypot(double{x2} - double{x1}, double{y2} - double{y1});
  };
  const auto right = static_cast<float>(scene.width - kStep);
  const auto bottom = static_cast<float>(scene.height - kStep);
  for (int x = kStep; x < scene.width - kStep; x += kStep)
    add(static_cast<float>(x), kStep, static_cast<float>(x), bottom);
  for (int y = kStep; y < scene.height - kStep; y += kStep)
    add(kStep, static_cast<float>(y), right, static_cast<float>(y));
  scene.events = test::make_events(edges, edge_options(scene, static_cast<double>(events) / sum_px));
  for (const test::MovingEdge& edge : edges) {
    const auto ends = [](const Segment& s) {
      return Curve{{double{s.x1}, double{s.y1}}, {double{s.x2}, double{s.y2}}};
    };
    scene.lines.push_back({ends(edge.begin), ends(edge.end)});
  }
  return scene;
}

}  // namespace lecalib::bench
