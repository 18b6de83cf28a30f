// SPDX-License-Identifier: MIT
/// From the events of a window to the lines at its begin and its end, by one of two detectors:
///
///     reference: events -> cloud (x, y, t/c_z) -> normals -> planes -> rims in each plane -> growth -> fit -> merge
///     fast:      events -> cloud -> sums over cells -> seeds                              -> growth -> fit -> merge
///
/// The reference takes its guesses from the chain of [Liu24] section 3.1, the fast one from blocks of cells that look
/// like an edge. The lines themselves come, in both, from a fit to all events near by that lets the line turn and bend,
/// because a turning line sweeps a helicoid and distortion bends it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/planes/cloud.hpp"
#include "lecalib/planes/pca_normals.hpp"
#include "lecalib/planes/region_growing.hpp"
#include "lecalib/segments/cell_seeds.hpp"
#include "lecalib/segments/failed_lines.hpp"
#include "lecalib/segments/line_crossings.hpp"
#include "lecalib/segments/line_extension.hpp"
#include "lecalib/segments/line_fit.hpp"
#include "lecalib/segments/line_growth.hpp"
#include "lecalib/segments/line_merge.hpp"
#include "lecalib/segments/line_shape.hpp"
#include "lecalib/segments/line_split.hpp"
#include "lecalib/segments/plane_lines.hpp"
#include "lecalib/segments/segment_detector.hpp"

namespace lecalib {

struct DetectorOptions;
struct DetectorStats;
struct DetectorWorkspace;

/// Finds the lines of a cloud one by one, into the workspace. Chosen by pointer, so that a program holds the code of
/// those detectors alone that it names.
/// @param[out] num_lines how many; unchanged unless ok
using LineFinder = Status (*)(const EventCloud& cloud, const DetectorOptions& options,
                              const DetectorWorkspace& workspace, std::size_t* num_lines, DetectorStats* stats);

/// Adds their edges to the lines found, which the workspace holds in the order of *out.
using EdgeFinder = void (*)(const EventCloud& cloud, float window_us, const DetectorOptions& options,
                            const DetectorWorkspace& workspace, Span<EventLine> out, DetectorStats* stats);

/// From blocks of cells that look like an edge.
Status fast_detector(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& workspace,
                     std::size_t* num_lines, DetectorStats* stats);

/// By the chain of [Liu24] section 3.1.
Status reference_detector(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& workspace,
                          std::size_t* num_lines, DetectorStats* stats);

/// Pixel by pixel, see fit_crossings().
void line_edges(const EventCloud& cloud, float window_us, const DetectorOptions& options,
                const DetectorWorkspace& workspace, Span<EventLine> out, DetectorStats* stats);

/// Defaults are good for any sensor; only its size must be given. Ranges stand with the fields.
struct DetectorOptions {
  LineFinder find_lines = fast_detector;  ///< or reference_detector
  CloudOptions cloud;                     ///< cloud.width and cloud.height: the sensor's size, px
  NormalOptions normals;
  RegionOptions regions;
  SegmentOptions segments;
  SeedOptions seeds;
  /// Growths that may fail in a window before the fast detector gives up: bounds the cost of texture.
  std::uint32_t max_failures = 250;
  GrowthOptions growth;
  LineFitOptions fit;
  ExtensionOptions extension;
  MergeOptions merge;
  LineShapeOptions shape;
  EdgeFinder find_edges = nullptr;  ///< or line_edges: fills EventLine::edge, where the window is not thinned
  CrossingOptions crossings;
  /// Monotonic clock for DetectorStats::stage_ns; null: stages are not timed.
  std::uint64_t (*clock_ns)() = nullptr;
};

/// Of what both detectors share; the reference checks the options of its own stages.
constexpr bool valid(const DetectorOptions& o) {
  return o.find_lines != nullptr && valid(o.growth) && valid(o.fit.gaps) && valid(o.crossings);
}

enum class DetectorStage : std::uint8_t { cloud, normals, planes, segments, seeds, lines, merge, shape, edges };
inline constexpr std::size_t kNumDetectorStages = 9;
/// The stage's name, e.g. "normals". Never null.
const char* to_string(DetectorStage stage) noexcept;

/// What became of everything in one window.
struct DetectorStats {
  CloudStats cloud;
  NormalStats normals;
  RegionStats regions;
  SegmentStats segments;
  std::uint32_t planes_of_constant_time = 0;  ///< flashes
  std::uint32_t guesses = 0;                  ///< lines that planes gave, or seeds
  std::uint32_t guesses_dropped = 0;          ///< for want of room
  /// Of a line that has failed, or their events belong to a line already, or there are too few.
  std::uint32_t guesses_repeated = 0;
  std::uint32_t fits[kNumFitOutcomes] = {};  ///< by FitOutcome
  std::uint32_t lines_extended = 0;          ///< through lines that they cross
  std::uint32_t lines_merged = 0;
  std::uint32_t lines_cut = 0;          ///< at gaps
  std::uint32_t lines_dropped = 0;      ///< for want of room in the workspace or the output, the weakest first
  std::uint32_t crossings_dropped = 0;  ///< pixels left out of the edges for want of room, evenly
  std::uint64_t stage_ns[kNumDetectorStages] = {};
};

struct DetectorCapacities {
  std::size_t events = 60000;          ///< of a window; more are thinned evenly
  std::size_t seeds = 4096;            ///< of the fast detector; the best are kept
  std::size_t surface_points = 20000;  ///< of the reference: events whose normal is taken; 0 without it
  std::size_t regions = 512;           ///< of the reference; 0 without it
  std::size_t lines = 128;             ///< 1 to kMaxLines
  std::size_t samples_per_line = 0;    ///< of LineSample, up to 96; 0: none are made
  std::size_t image_cells = 8192;      ///< of a plane's density image, 64 to 65535
  bool edges = true;                   ///< room for DetectorOptions::find_edges
  std::uint16_t width = 1280, height = 720;
};

struct DetectorWorkspace {
  CloudWorkspace cloud;
  Span<PlaneLine> guesses;         ///< [regions]
  Span<MovingLine> lines;          ///< [lines]
  Span<LineShape> shapes;          ///< [lines]
  Span<LineSample> samples;        ///< [lines * samples_per_line], see line_samples()
  Span<std::uint8_t> num_samples;  ///< [lines], or none
  // From here on the planes' part and the lines' part share their bytes.
  Span<SurfacePoint> surface;  ///< [surface_points]
  RegionWorkspace regions;
  Span<EventPlane> planes;     ///< [regions]
  Span<Point3> plane_points;   ///< [surface_points]
  Span<PlanePoint> projected;  ///< [surface_points]
  Span<PlaneSegment> rims;     ///< [kMaxRims]
  SegmentWorkspace segments;
  LineWorkspace fit;
  SeedWorkspace seeds;
  Span<MovingLine> failed;  ///< [kMaxFailedLines]
};

/// Rims of one plane that are looked at.
inline constexpr std::size_t kMaxRims = 64;
/// Failures that the detector remembers.
inline constexpr std::size_t kMaxFailedLines = 64;

template <class Carver>
constexpr bool carve(Carver& carver, const DetectorCapacities& capacities, DetectorWorkspace* out) {
  const CloudCapacities cloud{capacities.events, capacities.width, capacities.height};
  const RegionCapacities regions{capacities.surface_points, capacities.regions, capacities.width, capacities.height};
  const LineCapacities lines{capacities.events, capacities.width, capacities.height, capacities.edges};
  if (!carve(carver, cloud, &out->cloud) || !carver.carve(capacities.regions, &out->guesses) ||
      !carver.carve(capacities.lines, &out->lines) || !carver.carve(capacities.lines, &out->shapes) ||
      !carver.carve(capacities.lines * capacities.samples_per_line, &out->samples) ||
      !carver.carve(capacities.samples_per_line > 0 ? capacities.lines : 0, &out->num_samples)) {
    return false;
  }
  const std::size_t shared = carver.mark();
  const bool planes_fit =
      carver.carve(capacities.surface_points, &out->surface) && carve(carver, regions, &out->regions) &&
      carver.carve(capacities.regions, &out->planes) && carver.carve(capacities.surface_points, &out->plane_points) &&
      carver.carve(capacities.surface_points, &out->projected) && carver.carve(kMaxRims, &out->rims) &&
      carve(carver, SegmentCapacities{capacities.image_cells}, &out->segments);
  const std::size_t planes_end = carver.mark();
  carver.rewind(shared);
  if (!planes_fit || !carve(carver, lines, &out->fit) ||
      !carve(carver, SeedCapacities{capacities.seeds, capacities.width, capacities.height}, &out->seeds) ||
      !carver.carve(kMaxFailedLines, &out->failed)) {
    return false;
  }
  // Whoever carves next must come after the longer part.
  Span<std::byte> rest;
  return planes_end <= carver.mark() || carver.carve(planes_end - carver.mark(), &rest);
}

/// Bytes of an arena that holds a DetectorWorkspace of these capacities.
constexpr std::size_t detector_bytes(const DetectorCapacities& capacities) {
  ArenaMeter meter;
  DetectorWorkspace workspace{};
  (void)carve(meter, capacities, &workspace);
  return meter.peak();
}

/// Finds the lines of one window.
/// @param[out] out    the lines, most events first; as many as found room
/// @param[out] count  how many; unchanged unless ok
/// @param[out] stats  of this window; always written; may be null
/// @return ok, too without lines | invalid_argument (an option, the window, no or too many lines in the workspace) |
///         buffer_too_small (workspace)
///
/// Complexity O(events), with bounded work per plane and line. Allocates nothing. Not reentrant on one workspace.
Status detect_lines(const EventWindow& window, const DetectorOptions& options, DetectorWorkspace* workspace,
                    Span<EventLine> out, std::size_t* count, DetectorStats* stats);

/// The samples of a line of the last window, by its place in the output; none without room for them in the workspace.
Span<const LineSample> line_samples(const DetectorWorkspace& workspace, std::size_t line) noexcept;

}  // namespace lecalib
