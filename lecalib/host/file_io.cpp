// SPDX-License-Identifier: MIT
#include "lecalib/host/file_io.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
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

/// Closes a descriptor and removes the file unless keep() was called.
class TemporaryFile {
 public:
  TemporaryFile(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!kept_) ::unlink(path_.c_str());
  }

  bool write_all(std::string_view content) {
    while (!content.empty()) {
      const ssize_t written = ::write(descriptor_, content.data(), content.size());
      if (written < 0 && errno != EINTR) return false;
      if (written > 0) content.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }
  /// Files made by mkstemp are private; results are ordinary files.
  bool set_ordinary_mode() {
    const mode_t mask = ::umask(0);
    ::umask(mask);
    return ::fchmod(descriptor_, 0666 & ~mask) == 0;
  }
  bool close() {
    const int descriptor = descriptor_;
    descriptor_ = -1;
    return ::close(descriptor) == 0;
  }
  bool rename_to(const std::string& path) {
    kept_ = ::rename(path_.c_str(), path.c_str()) == 0;
    return kept_;
  }

 private:
  int descriptor_;
  std::string path_;
  bool kept_ = false;
};

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

MaybeError write_file(const std::string& path, std::string_view content) {
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0 && S_ISDIR(info.st_mode)) {
    return Error{"is a directory, expected the name of a file to write", path};
  }
  // A device or pipe (/dev/stdout) cannot be replaced by a file: it is written to.
  const bool special = ::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode);
  if (special) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wb"), &std::fclose);
    if (!file) return system_error(path, "write", errno);
    const bool written = std::fwrite(content.data(), 1, content.size(), file.get()) == content.size();
    if (!written || std::fflush(file.get()) != 0) return system_error(path, "write", errno);
    return std::nullopt;
  }
  std::string temporary = path + ".XXXXXX";
  const int descriptor = ::mkstemp(temporary.data());
  if (descriptor < 0) return system_error(path, "write", errno);
  TemporaryFile file(descriptor, temporary);
  if (!file.write_all(content) || !file.set_ordinary_mode() || !file.close() || !file.rename_to(path)) {
    return system_error(path, "write", errno);
  }
  return std::nullopt;
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
