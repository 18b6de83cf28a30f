// SPDX-License-Identifier: MIT
#include <cstdio>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/math/eigen.hpp"
#ifdef WITH_HOST
#include "lecalib/host/heap_arena.hpp"
#endif

int main() {
  std::printf("lecalib says %s\n", lecalib::to_string(lecalib::Status::ok));
#ifdef WITH_HOST
  if (lecalib::host::HeapArena(64).memory().size() != 64) return 1;
#endif
  return lecalib::Vec3(1.0, 2.0, 2.0).norm() == 3.0 ? 0 : 1;
}
