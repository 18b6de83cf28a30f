// SPDX-License-Identifier: MIT
#include "lecalib/host/file_io.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace lecalib::host {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{64} << 20U;

/// "cannot open: permission denied": the system's own words, in lower case like the rest of the line.
Error system_error(const std::string& path, const char* action, int code) {
  std::string reason = std::strerror(code);
  if (!reason.empty() && reason[0] >= 'A' && reason[0] <= 'Z') reason[0] = static_cast<char>(reason[0] - 'A' + 'a');
  return {std::string("cannot ") + action + ": " + reason, path, 0, 0, std::nullopt, Status::io_error};
}

/// A name that the system gives to an open file: /dev/stdout may lead to a regular file, but must not become one.
bool names_open_file(const std::string& path) {
  struct stat info {};
  const bool is_of_the_system = path.rfind("/dev/", 0) == 0 || path.rfind("/proc/", 0) == 0;
  return is_of_the_system && ::lstat(path.c_str(), &info) == 0 && S_ISLNK(info.st_mode);
}

/// Opens what is written to directly. The standard output goes on where it stands: opened anew it would begin again.
int open_directly(const std::string& path) {
  if (path != "/dev/stdout") return ::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  std::fflush(stdout);
  return ::dup(STDOUT_FILENO);
}

constexpr char kIsFolder[] = "is a directory, expected the name of a file to write";

bool is_folder(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 && S_ISDIR(info.st_mode);
}

/// Files made by mkstemp are private; results are ordinary files.
bool set_ordinary_mode(int descriptor) {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return ::fchmod(descriptor, 0666 & ~mask) == 0;
}

}  // namespace

Result<InputFile> InputFile::open(const std::string& path) {
  InputFile input;
  input.path_ = path;
  input.file_.reset(std::fopen(path.c_str(), "rb"));
  if (!input.file_) return system_error(path, "open", errno);
  struct stat info {};
  if (::fstat(::fileno(input.file_.get()), &info) != 0) return system_error(path, "open", errno);
  if (S_ISDIR(info.st_mode)) return Error{"is a directory, expected a file", path};
  if (S_ISREG(info.st_mode)) input.size_ = static_cast<std::uint64_t>(info.st_size);
  return input;
}

Result<std::size_t> InputFile::read(Span<std::uint8_t> out) {
  const std::size_t count = std::fread(out.data(), 1, out.size(), file_.get());
  if (count == 0 && std::ferror(file_.get()) != 0) return system_error(path_, "read", errno);
  return count;
}

Result<std::string> read_text_file(const std::string& path) {
  Result<InputFile> input = InputFile::open(path);
  if (!input.ok()) return input.error();
  std::string text;
  std::vector<std::uint8_t> chunk(std::size_t{1} << 16U);
  while (true) {
    const Result<std::size_t> count = input.value().read(chunk);
    if (!count.ok()) return count.error();
    if (count.value() == 0) break;
    if (text.size() + count.value() > kMaxTextBytes) return Error{"larger than 64 MiB, expected a small text", path};
    text.append(reinterpret_cast<const char*>(chunk.data()), count.value());
  }
  if (text.empty()) return Error{"the file is empty", path};
  return text;
}

OutputFile::OutputFile(int descriptor, std::string path, std::string temporary)
    : descriptor_(descriptor), path_(std::move(path)), temporary_(std::move(temporary)) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      unit_(other.unit_) {}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

bool is_written_directly(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return false;
  return !S_ISREG(info.st_mode) || names_open_file(path);
}

Result<OutputFile> OutputFile::create(const std::string& path) {
  if (is_folder(path)) return Error{kIsFolder, path};
  const bool is_direct = is_written_directly(path);
  std::string temporary = is_direct ? "" : path + ".XXXXXX";
  const int descriptor = is_direct ? open_directly(path) : ::mkstemp(temporary.data());
  if (descriptor < 0) return system_error(path, "write", errno);
  return OutputFile(descriptor, path, std::move(temporary));
}

Result<OutputFile> OutputFile::create_growing(const std::string& path, std::size_t unit) {
  if (is_folder(path)) return Error{kIsFolder, path};
  constexpr int kNew = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC;
  const int descriptor = is_written_directly(path) ? open_directly(path) : ::open(path.c_str(), kNew, 0666);
  if (descriptor < 0) return system_error(path, "write", errno);
  OutputFile file(descriptor, path, "");
  file.unit_ = unit;
  return file;
}

MaybeError OutputFile::write(std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor_, content.data(), content.size());
    if (written < 0 && errno != EINTR) {
      const int code = errno;
      cut_to_units();
      return system_error(path_, "write", code);
    }
    if (written > 0) content.remove_prefix(static_cast<std::size_t>(written));
  }
  return std::nullopt;
}

/// Of a unit whose first part still found room.
void OutputFile::cut_to_units() {
  struct stat info {};
  if (unit_ == 1 || ::fstat(descriptor_, &info) != 0 || !S_ISREG(info.st_mode)) return;
  const auto odd = info.st_size % static_cast<off_t>(unit_);
  if (odd != 0 && ::ftruncate(descriptor_, info.st_size - odd) != 0) return;  // a reader will find half a unit
}

MaybeError OutputFile::commit() {
  if (!temporary_.empty() && !set_ordinary_mode(descriptor_)) return system_error(path_, "write", errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) return system_error(path_, "write", errno);
  if (temporary_.empty()) return std::nullopt;
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) return system_error(path_, "write", errno);
  temporary_.clear();
  return std::nullopt;
}

MaybeError write_file(const std::string& path, std::string_view content) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file.ok()) return file.error();
  if (MaybeError error = file.value().write(content)) return error;
  return file.value().commit();
}

bool is_same_file(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  std::error_code code;
  if (fs::exists(a, code) && !fs::is_regular_file(a, code)) return false;
  if (fs::equivalent(a, b, code)) return true;
  const fs::path canonical = fs::weakly_canonical(a, code);
  return !code && canonical == fs::weakly_canonical(b, code) && !code;
}

MaybeError make_folder(const std::string& path) {
  std::error_code code;
  std::filesystem::create_directories(path, code);
  if (code) return system_error(path, "make the folder", code.value());
  if (!std::filesystem::is_directory(path, code)) return Error{"is not a folder", path};
  if (::access(path.c_str(), W_OK | X_OK) != 0) return system_error(path, "write to the folder", errno);
  return std::nullopt;
}

}  // namespace lecalib::host
