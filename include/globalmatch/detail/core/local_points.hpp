// The structure of arrays that all mapping steps share once a scan is imported.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <ranges>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

[[noreturn]] inline void refuse_size() {
  throw std::invalid_argument("scan: more than 2^32 - 1 points; thin it or split it");
}

/// For elements that are all set after a resize, each page by the thread that comes to it first: setting them
/// to zero beforehand would take as long on one thread.
template <class T>
struct unset_allocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = unset_allocator<U>;
  };
  template <class U>
  void construct(U* place) noexcept {
    ::new (static_cast<void*>(place)) U;
  }
};

template <class T>
using unset_vector = std::vector<T, unset_allocator<T>>;

/// Points of a scan in local float coordinates (good to 0.1 mm within a kilometre), each with its index in
/// the scan. It is itself a point range, in the local frame.
class local_points {
 public:
  local_frame frame;
  unset_vector<float> x, y, z;     ///< [m], local frame
  std::vector<point_index> index;  ///< in the caller's range

  std::size_t size() const { return x.size(); }
  vec3f operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }

  void push_back(const vec3f& p, point_index i) {
    x.push_back(p.x);
    y.push_back(p.y);
    z.push_back(p.z);
    index.push_back(i);
  }
  /// Coordinates beyond the old size are not set.
  void resize(std::size_t count) {
    x.resize(count);
    y.resize(count);
    z.resize(count);
    index.resize(count);
  }
  void reserve(std::size_t count) {
    x.reserve(count);
    y.reserve(count);
    z.reserve(count);
    index.reserve(count);
  }
};

/// The chosen ones of `points`, in the order of `chosen` (positions in `points`, not in the scan).
inline local_points select(const local_points& points, const std::vector<point_index>& chosen) {
  local_points result;
  result.frame = points.frame;
  result.reserve(chosen.size());
  for (const point_index i : chosen) result.push_back(points[i], points.index[i]);
  return result;
}

constexpr std::size_t points_a_chunk = 16384;  // of a scan: what is kept of them stays in a cache

/// One forward pass over a scan in chunks: `read(chunk, visit_points)` is called once for each, in parallel
/// where the range gives random access, else in order; `visit_points(visit)` calls `visit(p, i)` for the
/// points of the chunk, also for those that are not finite. `prepare(chunks)` is called first with their
/// number. Throws `std::invalid_argument` when there are more points than `point_index` can name.
template <point_range R, class Prepare, class Read>
void read_in_chunks(const R& scan, const execution& exec, std::string_view stage, const Prepare& prepare,
                    const Read& read) {
  constexpr std::size_t chunk_size = points_a_chunk;
  const auto count = static_cast<std::size_t>(std::ranges::distance(scan));
  if (count > std::numeric_limits<point_index>::max()) refuse_size();
  const auto visit_from = [](auto& at, std::size_t begin, std::size_t end) {
    return [&at, begin, end](const auto& visit) {
      for (std::size_t i = begin; i < end; ++i, ++at) visit(xyz(*at), static_cast<point_index>(i));
    };
  };
  prepare((count + chunk_size - 1) / chunk_size);
  if constexpr (std::ranges::random_access_range<const R>) {
    parallel_chunks(exec, stage, count, chunk_size, [&](std::size_t begin, std::size_t end) {
      auto at = std::ranges::begin(scan) + static_cast<std::ranges::range_difference_t<const R>>(begin);
      read(begin / chunk_size, visit_from(at, begin, end));
    });
  } else {
    auto at = std::ranges::begin(scan);
    for (std::size_t begin = 0; begin < count; begin += chunk_size) {
      report_progress(exec, stage, double(begin) / double(count));
      read(begin / chunk_size, visit_from(at, begin, std::min(count, begin + chunk_size)));
    }
  }
}

/// One set of points in parts, which lie in what threads gathered.
struct parted_points {
  struct part {
    const local_points* points;
    std::size_t begin, end;  ///< of the part

    std::size_t size() const { return end - begin; }
  };
  std::vector<std::unique_ptr<local_points>> gathered;
  std::vector<part> parts;  ///< in the order of the points

  parted_points() = default;
  /// In one part.
  explicit parted_points(local_points points) {
    gathered.push_back(std::make_unique<local_points>(std::move(points)));
    parts.push_back({gathered.front().get(), 0, gathered.front()->size()});
  }
};

/// The parts put together. Takes them.
inline local_points join_parts(parted_points from, const local_frame& frame, std::string_view stage,
                               const execution& exec) {
  const auto& parts = from.parts;
  std::vector<std::size_t> first(parts.size() + 1, 0);
  for (std::size_t k = 0; k < parts.size(); ++k) first[k + 1] = first[k] + parts[k].size();
  local_points all;
  all.frame = frame;
  all.resize(first.back());
  parallel_for(
      exec, stage, parts.size(),
      [&](std::size_t k) {
        const auto& [points, begin, end] = parts[k];
        const auto copy = [&, from = begin, count = end - begin](const auto& values, auto& to) {
          std::copy_n(values.begin() + std::ptrdiff_t(from), count, to.begin() + std::ptrdiff_t(first[k]));
        };
        copy(points->x, all.x), copy(points->y, all.y), copy(points->z, all.z);
        copy(points->index, all.index);
      },
      1);
  return all;
}

}  // namespace globalmatch::detail
