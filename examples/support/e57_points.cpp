#include "support/e57_points.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "support/scalars.hpp"

namespace globalmatch::support {

namespace {

enum packet_type { index_packet, data_packet, ignored_packet };

constexpr std::size_t points_at_once = point_source::block_size;
constexpr std::size_t bytes_behind = 9;  // the last value may end within a word, and a byte

template <class T>
T field(const char* bytes, std::size_t at) {
  return load<T>(bytes + at, std::endian::little);
}

// Bytes that the values [0, count) of a field take.
std::uint64_t bytes_of(const e57_field& field, std::uint64_t count) {
  return count / 8 * field.bits + (count % 8 * field.bits + 7) / 8;
}

// Values of `bits` bits each, the first of which begins at bit `bit` of `bytes`, which have eight more bytes
// than the values take. Each is loaded with one word, and the wide ones with a byte more.
void unpack_integers(const e57_field& field, const char* bytes, unsigned bit, std::span<double> values) {
  const std::uint64_t mask = field.bits == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << field.bits) - 1;
  std::uint64_t at = bit;
  for (double& value : values) {
    const char* const word = bytes + at / 8;
    const unsigned shift = at % 8;
    std::uint64_t raw = load<std::uint64_t>(word, std::endian::little) >> shift;
    if (shift + field.bits > 64) raw |= std::uint64_t(static_cast<unsigned char>(word[8])) << (64 - shift);
    const std::uint64_t integer = static_cast<std::uint64_t>(field.minimum) + (raw & mask);
    value = static_cast<double>(static_cast<std::int64_t>(integer)) * field.scale + field.offset;
    at += field.bits;
  }
}

void unpack(const e57_field& field, const char* bytes, unsigned bit, std::span<double> values) {
  if (field.type == e57_field::number::float32)
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<double>(load<float>(bytes + 4 * i, std::endian::little));
  else if (field.type == e57_field::number::float64)
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = load<double>(bytes + 8 * i, std::endian::little);
  else
    unpack_integers(field, bytes, bit, values);
}

// The smallest type that holds all values of a field.
scalar storage_of(const e57_field& field) {
  if (field.type == e57_field::number::float32) return scalar::float32;
  if (field.type == e57_field::number::float64 || field.scale != 1 || field.offset != 0)
    return scalar::float64;
  const auto min = static_cast<double>(field.minimum), max = min + std::ldexp(1.0, int(field.bits)) - 1;
  for (const scalar type :
       {scalar::uint8, scalar::int8, scalar::uint16, scalar::int16, scalar::uint32, scalar::int32})
    if (visit_type(type, [&]<class T>(T) {
          using limits = std::numeric_limits<T>;
          return min >= double(limits::min()) && max <= double(limits::max());
        }))
      return type;
  return scalar::int64;
}

Eigen::Vector3d from_spherical(double range, double azimuth, double elevation) {
  const double horizontal = range * std::cos(elevation);
  return {horizontal * std::cos(azimuth), horizontal * std::sin(azimuth), range * std::sin(elevation)};
}

}  // namespace

void e57_stream::append(std::uint64_t offset, std::uint64_t size) {
  if (size == 0) return;
  pieces_.push_back({size_, offset});
  size_ += size;
}

void e57_stream::read(const e57_pages& pages, std::uint64_t first, std::span<char> bytes) const {
  const auto starts_behind = [](std::uint64_t byte, const piece& p) { return byte < p.first; };
  auto next = std::upper_bound(pieces_.begin(), pieces_.end(), first, starts_behind);
  while (!bytes.empty()) {
    const piece& current = *std::prev(next);
    const std::uint64_t end = next == pieces_.end() ? size_ : next->first;
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), end - first));
    pages.read(current.offset + (first - current.first), bytes.first(count));
    bytes = bytes.subspan(count);
    first = end;
    if (next != pieces_.end()) ++next;
  }
}

e57_points::e57_points(std::shared_ptr<const e57_pages> pages, const e57_scan& scan, bool with_attributes)
    : pages_(std::move(pages)), scan_(scan), fields_(scan.coordinates.begin(), scan.coordinates.end()) {
  if (scan_.invalid_state) fields_.push_back(*scan_.invalid_state);
  for (const auto& [name, field] : scan_.numbers) {
    if (!with_attributes) break;
    // E57 counts returns from 0, and LAS from 1.
    const bool is_return = name == "returnIndex";
    attributes_.push_back({is_return ? "return_number" : name, storage_of(field), 1, is_return ? 1.0 : 0.0});
    fields_.push_back(field);
  }
  streams_.resize(fields_.size());
  if (!holds(scan_.size)) find_packets();
}

bool e57_points::holds(std::uint64_t points) const {
  for (std::size_t i = 0; i < fields_.size(); ++i)
    if (streams_[i].size() < bytes_of(fields_[i], points)) return false;
  return true;
}

// Fewer points may be what fills the last bytes of a packet.
bool e57_points::has_more() const {
  constexpr std::uint64_t filling = 8;
  return bytes_of(fields_[0], filling) > 0 && holds(scan_.size + filling);
}

void e57_points::find_packets() {
  const std::uint64_t section = pages_->offset_of(scan_.section);
  std::array<char, 32> header;
  pages_->read(section, header);
  const auto section_size = field<std::uint64_t>(header.data(), 8);
  if (header[0] != 1) pages_->fail_damaged("has no section of points where one should be");
  if (section_size > pages_->size() - section) pages_->fail_truncated();
  std::uint64_t packet = pages_->offset_of(field<std::uint64_t>(header.data(), 16));
  const std::uint64_t end = section + section_size;
  if (packet < section + header.size()) pages_->fail_damaged("has packets of points before their section");
  while (!holds(scan_.size)) {
    std::array<char, 4> start;
    if (packet > end || end - packet < start.size())
      pages_->fail("holds fewer points than the " + std::to_string(scan_.size) + " that it announces",
                   "Copy or export the scan again");
    pages_->read(packet, start);
    const std::uint64_t packet_size = std::uint64_t(field<std::uint16_t>(start.data(), 2)) + 1;
    if (packet_size % 4 != 0 || packet_size > end - packet)
      pages_->fail_damaged("has a packet of points that does not fit its section");
    if (start[0] == data_packet)
      add_packet(packet, packet_size);
    else if (start[0] != index_packet && start[0] != ignored_packet)
      pages_->fail_damaged("has a packet of points of unknown type");
    packet += packet_size;
  }
  // Behind them there may be pieces of fields that are not wanted, or further points.
  while (!has_more() && packet < end && end - packet >= 4) {
    std::array<char, 4> start;
    pages_->read(packet, start);
    const std::uint64_t packet_size = std::uint64_t(field<std::uint16_t>(start.data(), 2)) + 1;
    if (packet_size > end - packet) return;
    if (start[0] == data_packet) add_packet(packet, packet_size);
    packet += packet_size;
  }
}

// Notes where the pieces of the streams are in a packet of data: behind the sizes of all of them.
void e57_points::add_packet(std::uint64_t packet, std::uint64_t size) {
  constexpr std::size_t before_sizes = 6;
  const std::size_t header_size = before_sizes + 2 * scan_.streams;
  if (header_size > size) pages_->fail_damaged("has a packet of points that is too small for its fields");
  std::vector<char> header(header_size);
  pages_->read(packet, header);
  if (field<std::uint16_t>(header.data(), 4) != scan_.streams)
    pages_->fail_damaged("has a packet of points with other fields than the scan");
  std::uint64_t offset = header_size;
  for (std::size_t i = 0; i < scan_.streams; ++i) {
    const std::uint64_t piece = field<std::uint16_t>(header.data(), before_sizes + 2 * i);
    if (piece > size - offset) pages_->fail_damaged("has a packet of points that is smaller than its fields");
    for (std::size_t k = 0; k < fields_.size(); ++k)
      if (fields_[k].stream == i) streams_[k].append(packet + offset, piece);
    offset += piece;
  }
}

// What decoding needs for some points: the bytes of one field, and the values of some.
struct e57_points::buffers {
  buffers(std::size_t points, std::size_t fields)
      : bytes(std::make_unique_for_overwrite<char[]>(8 * points + bytes_behind + 1)),
        values(std::make_unique_for_overwrite<double[]>(fields * points)) {}

  std::unique_ptr<char[]> bytes;
  std::unique_ptr<double[]> values;
};

void e57_points::read(std::size_t first, std::span<Eigen::Vector3d> points) const {
  buffers room(std::min(points.size(), points_at_once), fields_.size() - attributes_.size());
  while (!points.empty()) {
    const auto some = points.first(std::min(points.size(), points_at_once));
    decode(first, some, room);
    first += some.size();
    points = points.subspan(some.size());
  }
}

// `bytes` has room for `buffers`.
void e57_points::decode_field(std::size_t index, std::size_t first, std::span<double> values,
                              char* bytes) const {
  const e57_field& f = fields_[index];
  const std::uint64_t bit = std::uint64_t(first % 8) * f.bits;
  const std::uint64_t begin = first / 8 * f.bits + bit / 8, end = bytes_of(f, first + values.size());
  const auto size = static_cast<std::size_t>(end - begin);
  streams_[index].read(*pages_, begin, {bytes, size});
  std::fill_n(bytes + size, bytes_behind, '\0');
  unpack(f, bytes, bit % 8, values);
}

void e57_points::decode(std::size_t first, std::span<Eigen::Vector3d> points, buffers& room) const {
  const auto values = [&](std::size_t field) { return room.values.get() + field * points.size(); };
  for (std::size_t i = 0; i < fields_.size() - attributes_.size(); ++i)
    decode_field(i, first, {values(i), points.size()}, room.bytes.get());
  const double *x = values(0), *y = values(1), *z = values(2);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = scan_.is_spherical ? from_spherical(x[i], y[i], z[i]) : Eigen::Vector3d(x[i], y[i], z[i]);
  if (!scan_.invalid_state) return;
  const double* invalid = values(3);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (invalid[i] != 0) points[i].setConstant(std::numeric_limits<double>::quiet_NaN());
}

void e57_points::read_attributes(std::size_t first, std::size_t count,
                                 std::span<attribute_column> columns) const {
  const std::size_t first_field = fields_.size() - attributes_.size();
  buffers room(std::min(count, points_at_once), 1);
  for (attribute_column& column : columns)
    visit_type(attributes_[column.attribute].type, [&]<class T>(T) {
      column.numbers.resize(count * sizeof(T));
      for (std::size_t done = 0; done < count;) {
        const std::span some(room.values.get(), std::min(count - done, points_at_once));
        decode_field(first_field + column.attribute, first + done, some, room.bytes.get());
        for (const double value : some) {
          const T number = nearest<T>(value);
          std::memcpy(column.numbers.data() + done++ * sizeof(T), &number, sizeof(T));
        }
      }
    });
}

}  // namespace globalmatch::support
