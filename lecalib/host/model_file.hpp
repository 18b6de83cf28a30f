// SPDX-License-Identifier: MIT
/// The line model of the calibration object: as a text file, or described in a few words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"

namespace lecalib::host {

/// Fewer coplanar lines leave a pose and one focal length undetermined ([Liu24] section 3.3: 4 coplanar, 6 otherwise).
inline constexpr std::size_t kMinModelLines = 4;

/// What a model may measure, metres. Whatever is larger or smaller is a slip, and its squares leave a double's range.
inline constexpr double kMaxModelMetres = 1e6;
inline constexpr double kMinModelMetres = 1e-6;

struct Model {
  std::vector<ModelLine> lines;    ///< metres, in the object's frame
  std::vector<std::string> names;  ///< of lines[i]; unique
};

/// Reads rows `x1 y1 z1 x2 y2 z2 name` in metres; '#' starts a comment, blank lines are skipped.
/// Errors carry line and column: fields missing or too many, not a finite number, a coordinate beyond kMaxModelMetres,
/// a segment shorter than kMinModelMetres, a name used twice, fewer than kMinModelLines rows.
/// @param file_name goes into the error.
Result<Model> parse_model(std::string_view text, const std::string& file_name);
Result<Model> read_model(const std::string& path);

/// Makes a model from a short description, metres:
///   rectangle:WxH        4 edges in the plane z = 0, one corner at the origin, W along x
///   box:WxHxD            12 edges, one corner at the origin, W along x, H along y, D along z
///   checkerboard:CxR:S   C by R inner corners of squares S wide, the first at the origin; C lines along y and R along
///                        x through them up to the rim of the pattern, and the 4 lines of the rim (dashed in the
///                        image, but without them the pattern would look the same when shifted by one square)
///   file:PATH            a model file
Result<Model> make_target(std::string_view spec);

}  // namespace lecalib::host
