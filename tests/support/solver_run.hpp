// SPDX-License-Identifier: MIT
/// A MonoSolver with exactly the memory it needs, run to its end; fails the test where it touches the heap.
#pragma once

#include <doctest/doctest.h>

#include "lecalib/pipeline/mono_solver.hpp"
#include "support/alloc_counter.hpp"
#include "support/guarded_arena.hpp"

namespace lecalib::test {

inline MonoSolverCapacities capacities_for(const CalibrationData& data) {
  return {data.views.size(), data.points.size(), data.model.size(), data.edges.size()};
}

struct SolverRun {
  explicit SolverRun(const CalibrationData& data, const MonoSolverOptions& options = {},
                     const MonoStart* start = nullptr)
      : memory(required_bytes(capacities_for(data))) {
    REQUIRE(carve(memory.arena(), capacities_for(data), &workspace));
    const AllocScope heap;
    status = start != nullptr ? solver.init(data, options, workspace, *start) : solver.init(data, options, workspace);
    if (status == Status::ok) {
      do {
        status = solver.step();
        ++steps;
      } while (status == Status::in_progress);
    }
    allocations = heap.allocations();
    CHECK(allocations == 0);
  }
  [[nodiscard]] const CalibrationResult& result() const { return solver.result(); }

  GuardedArena memory;
  MonoSolverWorkspace workspace;
  MonoSolver solver;
  Status status = Status::ok;
  int steps = 0;
  std::size_t allocations = 0;
};

}  // namespace lecalib::test
