// SPDX-License-Identifier: MIT
#include "lecalib/match/contrast_votes.hpp"

#include <algorithm>

namespace lecalib {
namespace {

constexpr int kMinVotes = 4;
/// The minority must be at most this share of all votes.
constexpr double kMaxMinority = 0.25;

}  // namespace

int contrast_of(const EventLine& line, double min_motion_px) {
  Vec2 points[kLinePoints];
  line_points(line, Instant::middle, points);
  const Vec2 chord = points[2] - points[0];
  const double length = chord.norm();
  if (line.polarity == 0 || !(length > 0.0)) return 0;
  Vec2 begin[kLinePoints];
  Vec2 end[kLinePoints];
  line_points(line, Instant::begin, begin);
  line_points(line, Instant::end, end);
  const Vec2 motion = 0.5 * (end[0] + end[2] - begin[0] - begin[2]);
  const double across = (chord.x() * motion.y() - chord.y() * motion.x()) / length;
  if (across > -min_motion_px && across < min_motion_px) return 0;
  return (across > 0.0) == (line.polarity > 0) ? -1 : 1;
}

int decided_contrast(const ContrastVote& vote) {
  const int votes = vote.positive + vote.negative;
  if (votes < kMinVotes || std::min(vote.positive, vote.negative) > kMaxMinority * votes) return 0;
  return vote.positive > vote.negative ? 1 : -1;
}

}  // namespace lecalib
