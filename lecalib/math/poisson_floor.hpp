// SPDX-License-Identifier: MIT
/// The mean of Poisson's distribution from counts of which an unknown share holds something else on top.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// Maximum likelihood for a mixture: an unknown share of the counts follows Poisson's distribution; the others are
/// free, but lie above the `quiet_share` quantile. Counts up to that quantile have the same shape whatever that share
/// is (Poisson's distribution truncated on the right), so it need not be known; where the shape asks for a share above
/// one, the share is one (Poisson's distribution censored on the right).
/// @param histogram    [n], n >= 3: how often each count occurs; the last entry takes all larger ones too
/// @param quiet_share  0 to 1, of the counts. Truth may lie above the result when less than this share is Poisson's
/// @return the mean, 0 without counts; at most 2 n. Cost: some hundred divisions for every count below the quantile
float poisson_floor(Span<const std::uint32_t> histogram, float quiet_share);

}  // namespace lecalib
