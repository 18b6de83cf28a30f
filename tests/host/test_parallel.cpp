// SPDX-License-Identifier: MIT
#include "lecalib/host/parallel.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <initializer_list>
#include <stdexcept>
#include <thread>
#include <vector>

using lecalib::host::parallel_for;

TEST_CASE("parallel: each index is worked on once, whatever the number of threads") {
  for (const unsigned threads : {1U, 2U, 7U}) {
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{1000}}) {
      std::vector<std::atomic<int>> visits(count);
      parallel_for(count, threads, [&](std::size_t i) { ++visits[i]; });
      for (const std::atomic<int>& visit : visits) CHECK(visit == 1);
    }
  }
}

TEST_CASE("parallel: progress is told on the calling thread, never falls and ends at the count when alone") {
  const std::thread::id caller = std::this_thread::get_id();
  for (const unsigned threads : {1U, 3U}) {
    std::size_t last = 0;
    bool on_caller = true;
    bool rises = true;
    parallel_for(
        500, threads, [](std::size_t) {},
        [&](std::size_t begun) {
          on_caller = on_caller && std::this_thread::get_id() == caller;
          rises = rises && begun > last && begun <= 500;
          last = begun;
        });
    CHECK(on_caller);
    CHECK(rises);
    if (threads == 1) CHECK(last == 500);
  }
}

TEST_CASE("parallel: an exception of any thread ends the work and is thrown to the caller") {
  for (const unsigned threads : {1U, 4U}) {
    std::atomic<int> calls{0};
    const auto work = [&](std::size_t i) {
      ++calls;
      if (i == 20) throw std::runtime_error("twenty");
    };
    CHECK_THROWS_WITH(parallel_for(1000000, threads, work), "twenty");
    CHECK(calls < 1000000);
  }
}
