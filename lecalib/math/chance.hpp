// SPDX-License-Identifier: MIT
/// How much events say against chance. Counts of accidental events follow Poisson's distribution, whose tail is bounded
/// by its first term and a geometric series, or by Chernoff's bound where that is the lower: logarithms and no sum.
#pragma once

namespace lecalib {

/// Natural logarithm, the same bits on every target; absolute error below 3e-7 for x near 1, relative below 1e-6.
/// @param x > 0, finite and not subnormal; of less, and of NaN, the logarithm of the smallest normal number is given,
///          of infinity that of 2^128
float natural_log(float x);

/// Minus the logarithm of a bound on the probability that chance puts at least `events` where it puts `expected` on
/// average, nats; 0 when there are no more than expected.
/// @param expected  >= 0; below 0.1 it counts as 0.1: nothing is known to be so free of noise
float evidence_against_chance(float events, float expected);

}  // namespace lecalib
