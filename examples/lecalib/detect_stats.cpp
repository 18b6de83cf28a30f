// SPDX-License-Identifier: MIT
#include "detect.hpp"
#include "lecalib/host/json_writer.hpp"

namespace lecalib::command {
namespace {

void add_times(const host::EventFile& file, const WindowSource& windows, const DetectTotals& totals,
               host::JsonWriter* json) {
  const std::uint64_t count = windows.stats().events;
  const double events = count > 0 ? static_cast<double>(count) : 1;
  const auto per_event = [events](std::uint64_t ns) { return static_cast<double>(ns) / events; };
  json->key("cpu_ns_per_event");
  json->begin_object();
  json->member("decode", per_event(file.decode_cpu_ns()));
  json->member("windows", per_event(windows.cpu_ns()));
  json->member("noise", per_event(totals.noise_ns));
  for (std::size_t i = 0; i < kNumDetectorStages; ++i) {
    json->member(to_string(static_cast<DetectorStage>(i)), per_event(totals.stage_ns[i]));
  }
  json->member("total", per_event(windows.cpu_ns() + totals.noise_ns + totals.detector_ns));
  json->end();
}

}  // namespace

void DetectTotals::add(const DetectorStats& stats) {
  for (std::size_t i = 0; i < kNumDetectorStages; ++i) stage_ns[i] += stats.stage_ns[i];
  guesses_dropped += stats.guesses_dropped;
  lines_dropped += stats.lines_dropped;
}

std::string detect_stats_json(const host::EventFile& file, const WindowSource& windows, const DetectTotals& totals) {
  const WindowStats& cut = windows.stats();
  host::JsonWriter json;
  json.begin_object();
  json.member("events", cut.events);
  json.member("windows", cut.windows);
  json.member("lines", totals.lines);
  add_times(file, windows, totals, &json);
  json.member("arena_bytes", totals.arena_bytes);
  json.key("dropped");
  json.begin_object();
  json.member("outside", file.stats().outside + totals.noise.outside);
  json.member("unplaced", file.stats().unplaced);
  json.member("time_backward", cut.backward);
  json.member("thinned", cut.thinned);
  json.member("hot", totals.noise.hot);
  json.member("refractory", totals.noise.refractory);
  json.member("flicker", totals.noise.flicker);
  json.member("isolated", totals.noise.isolated);
  json.member("guesses", totals.guesses_dropped);
  json.member("lines", totals.lines_dropped);
  json.end();
  json.end();
  return json.text();
}

}  // namespace lecalib::command
