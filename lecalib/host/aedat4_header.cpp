// SPDX-License-Identifier: MIT
#include "lecalib/host/aedat4_header.hpp"

#include <limits>
#include <vector>

#include "lecalib/host/flatbuffer.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr std::size_t kMaxDepth = 64;  // of nodes; real headers have four levels

/// The value of `name="..."` in a tag; empty without it.
std::string_view attribute(std::string_view tag, std::string_view name) {
  const std::string wanted = " " + std::string(name) + "=\"";
  const std::size_t at = tag.find(wanted);
  if (at == std::string_view::npos) return {};
  tag.remove_prefix(at + wanted.size());
  return tag.substr(0, tag.find('"'));
}

bool starts_with(std::string_view text, std::string_view front) { return text.substr(0, front.size()) == front; }

std::uint16_t side(std::string_view text) {
  const auto count = parse_count(text);
  return count && *count <= std::numeric_limits<std::uint16_t>::max() ? static_cast<std::uint16_t>(*count) : 0;
}

/// Takes in <attr key="KEY" ...>VALUE</attr> in the node that `path` leads to.
void take_attribute(const std::vector<std::string_view>& path, std::string_view key, std::string_view value,
                    std::map<std::int32_t, Aedat4Stream>* streams) {
  if (path.size() < 2 || path[0] != "outInfo") return;
  const auto number = parse_count(path[1]);
  if (!number || *number > static_cast<unsigned long long>(std::numeric_limits<std::int32_t>::max())) return;
  const auto stream_of = [&]() -> Aedat4Stream& { return (*streams)[static_cast<std::int32_t>(*number)]; };
  if (path.size() == 2 && key == "typeIdentifier") stream_of().type = std::string(value);
  if (path.size() == 3 && path[2] == "info" && key == "sizeX") stream_of().size.width = side(value);
  if (path.size() == 3 && path[2] == "info" && key == "sizeY") stream_of().size.height = side(value);
}

}  // namespace

std::map<std::int32_t, Aedat4Stream> read_aedat4_streams(std::string_view xml) {
  std::map<std::int32_t, Aedat4Stream> streams;
  std::vector<std::string_view> path;
  while (true) {
    const std::size_t open = xml.find('<');
    const std::size_t close = xml.find('>', open == std::string_view::npos ? 0 : open);
    if (open == std::string_view::npos || close == std::string_view::npos) return streams;
    const std::string_view tag = xml.substr(open + 1, close - open - 1);
    xml.remove_prefix(close + 1);
    const bool is_empty = !tag.empty() && tag.back() == '/';
    if (starts_with(tag, "node ") && !is_empty) {
      if (path.size() == kMaxDepth) return streams;
      path.push_back(attribute(tag, "name"));
    } else if (starts_with(tag, "/node") && !path.empty()) {
      path.pop_back();
    } else if (starts_with(tag, "attr ")) {
      take_attribute(path, attribute(tag, "key"), xml.substr(0, xml.find('<')), &streams);
    }
  }
}

std::optional<Aedat4Header> read_aedat4_header(Span<const std::uint8_t> bytes) {
  const FlatBuffer buffer(bytes);
  const std::optional<std::size_t> root = buffer.follow(0);
  if (!root || !buffer.has_identifier(4, "IOHE")) return std::nullopt;
  const auto compression = buffer.field(*root, 0);
  const auto table = buffer.field(*root, 1);
  const auto info = buffer.field(*root, 2);
  if (!compression || !table || !info) return std::nullopt;
  Aedat4Header header;
  if (*compression != 0) {
    const auto value = buffer.read<std::int32_t>(*compression);
    if (!value) return std::nullopt;
    header.compression = static_cast<Compression>(*value);
  }
  if (*table != 0) {
    const auto value = buffer.read<std::int64_t>(*table);
    if (!value) return std::nullopt;
    header.table_offset = *value;
  }
  if (*info != 0) {
    const auto xml = buffer.vector(*info, 1);
    if (!xml) return std::nullopt;
    header.streams = read_aedat4_streams({reinterpret_cast<const char*>(xml->data()), xml->size()});
  }
  return header;
}

}  // namespace lecalib::host
