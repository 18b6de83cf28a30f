// SPDX-License-Identifier: MIT
#include "lecalib/host/side_writer.hpp"

#include <cmath>

#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr char kImuTitle[] = "t_us,wx,wy,wz,ax,ay,az,temperature_c\n";
constexpr char kTriggersTitle[] = "t_us,channel,kind\n";

const char* name_of(TriggerKind kind) {
  switch (kind) {
    case TriggerKind::falling: return "falling";
    case TriggerKind::rising: return "rising";
    case TriggerKind::pulse: return "pulse";
    case TriggerKind::other: return "other";
  }
  return "";
}

void append(float value, std::string* text) {
  *text += ',';
  *text += std::isnan(value) ? "nan" : shortest(static_cast<double>(value));
}

/// Opens a file and writes its title; nothing where the path is empty.
MaybeError begin(const std::string& path, const char* title, std::optional<OutputFile>* file) {
  if (path.empty()) return std::nullopt;
  Result<OutputFile> created = OutputFile::create(path);
  if (!created.ok()) return created.error();
  file->emplace(std::move(created).value());
  return (*file)->write(title);
}

}  // namespace

void append_imu_csv(Span<const ImuSample> samples, std::string* text) {
  for (const ImuSample& sample : samples) {
    *text += std::to_string(sample.t_us);
    for (const float rate : sample.gyro_rad_s) append(rate, text);
    for (const float acceleration : sample.accel_m_s2) append(acceleration, text);
    append(sample.temperature_c, text);
    *text += '\n';
  }
}

void append_triggers_csv(Span<const TriggerEvent> triggers, std::string* text) {
  for (const TriggerEvent& trigger : triggers) {
    *text += std::to_string(trigger.t_us) + ',' + std::to_string(trigger.channel) + ',' + name_of(trigger.kind) + '\n';
  }
}

Result<SideWriter> SideWriter::create(const std::string& imu_path, const std::string& triggers_path) {
  SideWriter writer;
  if (MaybeError error = begin(imu_path, kImuTitle, &writer.imu_)) return *std::move(error);
  if (MaybeError error = begin(triggers_path, kTriggersTitle, &writer.triggers_)) return *std::move(error);
  return writer;
}

MaybeError SideWriter::write(Span<const ImuSample> samples, Span<const TriggerEvent> triggers) {
  if (imu_) {
    buffer_.clear();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (num_imu_samples_ > 0 && samples[i].t_us <= last_imu_us_) {
        ++num_left_out_;
        continue;
      }
      ++num_imu_samples_;
      last_imu_us_ = samples[i].t_us;
      append_imu_csv(samples.subspan(i, 1), &buffer_);
    }
    if (MaybeError error = imu_->write(buffer_)) return error;
  }
  if (!triggers_) return std::nullopt;
  buffer_.clear();
  append_triggers_csv(triggers, &buffer_);
  num_triggers_ += triggers.size();
  return triggers_->write(buffer_);
}

MaybeError SideWriter::commit() {
  if (imu_) {
    if (MaybeError error = imu_->commit()) return error;
  }
  return triggers_ ? triggers_->commit() : std::nullopt;
}

}  // namespace lecalib::host
