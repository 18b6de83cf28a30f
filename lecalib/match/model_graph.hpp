// SPDX-License-Identifier: MIT
/// What the 3D line model looks like locally: which lines meet, and which four close a flat quadrilateral (the faces of
/// a box, a sheet, the panes of a window). Four lines of a plane fix focal length and pose, so such quads start the
/// search.
#pragma once

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

/// Four model lines around a plane face. corner[i] is where side i meets side i + 1.
struct ModelQuad {
  std::uint16_t line[4];
  double corner[4][3];
  double area_m2;
  bool closed;  ///< every corner is an end of both of its lines
};

/// The faces of a solid that meet in a model line. Both are known for the edges of a closed box, fewer elsewhere.
struct ModelSides {
  double plane[2][4];  ///< n . x > d in front of the face, outside of the solid
  int num;
};

struct ModelGraph {
  Span<const ModelLine> lines;
  Span<const ModelSides> sides;  ///< [lines]
  Span<const ModelQuad> quads;   ///< closed ones first, then the largest first
  double extent_m = 0;           ///< diagonal of the bounding box
  double centre_m[3] = {0, 0, 0};
  std::uint32_t quads_dropped = 0;  ///< found beyond the capacity: the smallest
};

struct ModelGraphOptions {
  /// Lines meet when they pass within this share of the shorter one's length, and as far beyond their ends. (0, 0.2].
  double corner_tolerance = 0.02;
};

/// Checks the model and finds its quads.
/// @param storage  memory for the quads, its size the capacity
/// @param sides  memory for the lines' faces, at least model.size()
/// @return ok (also with no quad) | invalid_argument (a value is not finite, a line of no length, an option) |
///         too_few_lines (less than 4) | degenerate_geometry (all lines parallel)
/// Complexity O(n^4) in the worst case, n^2 times the number of meeting lines squared in practice.
Status build_model_graph(Span<const ModelLine> model, const ModelGraphOptions& options, Span<ModelQuad> storage,
                         Span<ModelSides> sides, ModelGraph* out);

/// True when every face that meets in the line is turned away from a camera at `eye`, while another face is turned to
/// it: the solid itself hides the line. Models without known faces (sheets, windows) hide nothing, nor does a room
/// around the camera.
bool is_hidden(const ModelGraph& graph, std::size_t line, const double (&eye)[3]);

}  // namespace lecalib
