// SPDX-License-Identifier: MIT
#include "usb/mock_bench.hpp"

#include <sys/stat.h>

namespace lecalib::test {
namespace {

constexpr std::chrono::milliseconds kTend{5};

}  // namespace

MockBench::MockBench() : bed_(umockdev_testbed_new()), loop_(g_main_loop_new(nullptr, FALSE)) {
  char* const root = umockdev_testbed_get_root_dir(bed_);
  (void)::chmod(root, 0777);  // udev's socket is made there, also by a program that somebody else runs
  g_free(root);
  loop_thread_ = std::thread([this] { g_main_loop_run(loop_); });
}

MockBench::~MockBench() {
  ports_.clear();
  g_main_loop_quit(loop_);
  loop_thread_.join();
  g_main_loop_unref(loop_);
  g_object_unref(bed_);
}

CommandRun MockBench::run(const std::vector<std::string>& arguments, RunAs who) {
  StartedCommand command(arguments, who);
  while (!command.has_ended()) {
    std::this_thread::sleep_for(kTend);
    tend();
    meanwhile(command.pid());
  }
  ended_ = Clock::now();
  return command.finish();
}

void MockBench::tend() {
  for (const auto& port : ports_) {
    if (!port->is_unplugged()) continue;
    if (!is_away_) {
      is_away_ = true;
      unplugged_ = Clock::now();
      port->remove();
    } else if (replug_after_ms >= 0 && Clock::now() - unplugged_ > std::chrono::milliseconds(replug_after_ms)) {
      is_away_ = false;
      replug_after_ms = -1;
      port->replug();
    }
  }
}

double MockBench::seconds_since_unplugged() const { return std::chrono::duration<double>(ended_ - unplugged_).count(); }

}  // namespace lecalib::test
