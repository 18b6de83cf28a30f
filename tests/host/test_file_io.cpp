// SPDX-License-Identifier: MIT
#include "lecalib/host/file_io.hpp"

#include <doctest/doctest.h>

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>

#include "support/temporary_folder.hpp"

using namespace lecalib::host;
using lecalib::test::TemporaryFolder;
namespace fs = std::filesystem;

TEST_CASE("a file is written whole and replaces the old one") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.txt";
  REQUIRE_FALSE(write_file(path, "first"));
  REQUIRE_FALSE(write_file(path, std::string("sec\0nd", 6)));
  const auto text = read_text_file(path);
  REQUIRE(text.ok());
  CHECK(text.value() == std::string("sec\0nd", 6));
  CHECK(folder.count() == 1);
  struct stat info {};
  REQUIRE(::stat(path.c_str(), &info) == 0);
  CHECK((info.st_mode & 0400U) != 0);
}

TEST_CASE("a write that cannot succeed says why and leaves nothing") {
  const TemporaryFolder folder;
  const auto missing = write_file(folder / "no/a.txt", "x");
  REQUIRE(missing);
  CHECK(to_string(*missing) == (folder / "no/a.txt") + ": cannot write: no such file or directory");
  const auto directory = write_file(folder.path(), "x");
  REQUIRE(directory);
  CHECK(directory->message == "is a directory, expected the name of a file to write");
  CHECK(folder.count() == 0);
}

TEST_CASE("a device is written to, not replaced") {
  CHECK_FALSE(write_file("/dev/null", "x"));
  CHECK(fs::is_character_file("/dev/null"));
  const auto full = write_file("/dev/full", "x");
  REQUIRE(full);
  CHECK(to_string(*full) == "/dev/full: cannot write: no space left on device");
}

TEST_CASE("an empty text is an error with its file") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "empty", ""));
  const auto text = read_text_file(folder / "empty");
  REQUIRE_FALSE(text.ok());
  CHECK(to_string(text.error()) == (folder / "empty") + ": the file is empty");
}

TEST_CASE("folders are made with their parents; a file in the way is an error") {
  const TemporaryFolder folder;
  CHECK_FALSE(make_folder(folder / "a/b"));
  CHECK_FALSE(make_folder(folder / "a/b"));
  REQUIRE_FALSE(write_file(folder / "a/f", "x"));
  const auto error = make_folder(folder / "a/f");
  REQUIRE(error);
  CHECK(error->file == folder / "a/f");
}

TEST_CASE("a file that grows is there from the begin, and after a failed write it ends with a whole unit") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.raw";
  REQUIRE_FALSE(write_file(path, "old"));
  auto file = OutputFile::create_growing(path, 4);
  REQUIRE(file.ok());
  CHECK(fs::file_size(path) == 0);
  REQUIRE_FALSE(file.value().write("12345678"));
  CHECK(fs::file_size(path) == 8);
  // A limit in the middle of a unit stands for a disk that is full there.
  struct rlimit before {};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  const struct rlimit limit { 18, before.rlim_max };
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
  const auto error = file.value().write("abcdefghijkl");
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
  (void)::signal(SIGXFSZ, handler);
  REQUIRE(error);
  CHECK(error->message == "cannot write: file too large");
  CHECK(read_text_file(path).value() == "12345678abcdefgh");
  CHECK(OutputFile::create_growing(folder.path(), 2).error().message.rfind("is a directory", 0) == 0);
  CHECK_FALSE(OutputFile::create_growing(folder / "no/a", 2).ok());
}
