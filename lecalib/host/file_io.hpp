// SPDX-License-Identifier: MIT
/// Whole files in and out, with errors that say what the operating system refused.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "lecalib/core/span.hpp"
#include "lecalib/host/error.hpp"

namespace lecalib::host {

/// A regular file, pipe or device opened for reading. Directories and missing files are errors of open().
class InputFile {
 public:
  static Result<InputFile> open(const std::string& path);
  /// Reads up to out.size() bytes; 0 only at the end of the file.
  Result<std::size_t> read(Span<std::uint8_t> out);
  /// Size in bytes, or 0 when it has none (a pipe).
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t size_ = 0;
};

/// All of a text file. Refuses files above 64 MiB: whatever that is, it is not a model or a list of observations.
Result<std::string> read_text_file(const std::string& path);

/// A file that is written piece by piece and stands under its name once all is there: until commit() the pieces go to a
/// temporary file beside it, which vanishes with this object. Where is_written_directly() there is none, nor for a
/// file that grows.
class OutputFile {
 public:
  static Result<OutputFile> create(const std::string& path);
  /// One that stands under its name from the begin and grows, so that what was written stays however the program ends.
  /// @param unit  after a write that failed its size is a multiple of this
  static Result<OutputFile> create_growing(const std::string& path, std::size_t unit);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  MaybeError write(std::string_view content);
  /// The file is whole.
  MaybeError commit();
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  OutputFile(int descriptor, std::string path, std::string temporary);
  void cut_to_units();

  int descriptor_;
  std::string path_;
  std::string temporary_;  ///< empty for devices, pipes and files that grow
  std::size_t unit_ = 1;
};

/// Whether OutputFile writes to what the path names without a temporary file: a device, a pipe, and an open file by a
/// name like /dev/stdout.
bool is_written_directly(const std::string& path);

/// Writes a file so that a reader sees either all of it or what was there before: into a temporary file beside it,
/// which then takes its name. On error nothing is left behind.
MaybeError write_file(const std::string& path, std::string_view content);

/// Whether writing to one path would touch the other: one name, or two names of one file. Devices and pipes take any
/// number of writers and are never the same.
bool is_same_file(const std::string& a, const std::string& b);

/// Makes `path` a folder if it is none, with its parents. Refuses one that takes no files, so that long work does not
/// find out at its end.
MaybeError make_folder(const std::string& path);

}  // namespace lecalib::host
