// What a point is, and what a range of points is: the only place where the caller's own types are read.
#pragma once

#include <array>
#include <compare>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <ranges>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "globalmatch/detail/core/vectors.hpp"

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__) || defined(_M_FP_FAST)
#error "globalmatch needs not-a-number and infinity: compile without -ffast-math and -ffinite-math-only."
#endif
#if !defined(__cpp_exceptions) && !defined(_CPPUNWIND)
#error "globalmatch reports bad arguments by exceptions: compile without -fno-exceptions."
#endif

namespace globalmatch {

/// Position of a point in the range it came from. Scans hold at most 2^32 - 1 points.
using point_index = std::uint32_t;
/// Position of a stem in the range it came from.
using stem_index = std::uint32_t;

/// Specialise to make a foreign type a point: `static auto xyz(const P&)` returns anything with `[0] [1] [2]`
/// (or `[0] [1]` and `static constexpr int dimension = 2` for a position in plan). Optional members:
/// `radius(const P&)` [m], `position_sigma(const P&)` and `height_sigma(const P&)` [m, 0 where unknown], and
/// `axis(const P&)`, a unit vector that points up along the stem, or zero where it is not known. Types with
/// `.x .y .z`, or of a fixed size with
/// `[0] [1] [2]`, need no specialisation; a member `.radius` [m] is read as well.
template <class P>
struct point_traits;

namespace detail {

template <class P>
concept has_point_traits = requires(const P& p) {
  point_traits<P>::xyz(p);
};

template <class P>
concept has_xy_members = requires(const P& p) {
  { p.x } -> std::convertible_to<double>;
  { p.y } -> std::convertible_to<double>;
};

template <class P>
concept has_xyz_members = has_xy_members<P> && requires(const P& p) {
  { p.z } -> std::convertible_to<double>;
};

template <class P>
constexpr int fixed_size() {
  if constexpr (requires { P::SizeAtCompileTime; }) {
    if constexpr (requires { P::IsVectorAtCompileTime; })
      if (!P::IsVectorAtCompileTime) return -1;  // a matrix is no point
    return static_cast<int>(P::SizeAtCompileTime);
  } else if constexpr (std::is_bounded_array_v<P>) {
    return static_cast<int>(std::extent_v<P>);
  } else if constexpr (requires { std::tuple_size<P>::value; }) {
    return static_cast<int>(std::tuple_size<P>::value);
  } else {
    return -1;
  }
}

template <class P>
concept has_fixed_size_index = fixed_size<P>()
>= 2 && requires(const P& p) {
  { p[0] } -> std::convertible_to<double>;
};

/// 3 for points, 2 for positions in plan, 0 for what is neither.
template <class P>
constexpr int dimension() {
  if constexpr (has_point_traits<P>) {
    if constexpr (requires { point_traits<P>::dimension; }) {
      return point_traits<P>::dimension;
    } else {
      return 3;
    }
  } else if constexpr (has_xyz_members<P>) {
    return 3;
  } else if constexpr (has_xy_members<P>) {
    return 2;
  } else if constexpr (has_fixed_size_index<P>) {
    return fixed_size<P>() >= 3 ? 3 : 2;
  } else {
    return 0;
  }
}

}  // namespace detail

/// A type whose x, y and z can be read: see `point_traits`.
template <class P>
concept point = detail::dimension<std::remove_cvref_t<P>>()
== 3;

/// A point, or a position in plan that has no height.
template <class P>
concept position = detail::dimension<std::remove_cvref_t<P>>()
>= 2;

namespace detail {

/// Can be iterated over more than once while it is const: functions take ranges by const reference.
template <class R>
concept const_forward_range = std::ranges::forward_range < const std::remove_reference_t<R>
& > ;

template <class R>
using element_of = std::ranges::range_reference_t<const std::remove_reference_t<R>&>;

}  // namespace detail

/// Anything to iterate over more than once, also while it is const, whose elements are points:
/// `std::vector<MyPoint>`, `pcl::PointCloud<T>`, `matrix.colwise()`, `strided_points(...)`,
/// `soa_points(...)`, and views of these such as `std::views::transform` and `take`. Views that find their
/// begin when asked (`filter`, `drop_while`) are none: copy what they yield, or use `subset_points`. Ranges
/// that give random access are read from several threads at once.
template <class R>
concept point_range = detail::const_forward_range<R> && point<detail::element_of<R>>;

/// The same, whose elements are positions: points, or without a height.
template <class R>
concept position_range = detail::const_forward_range<R> && position<detail::element_of<R>>;

/// Coordinates of a point as doubles, with members `x`, `y`, `z`, `[i]` and `as<Vector>()`; the height of a
/// position in plan is 0.
template <position P>
detail::vec3 xyz(const P& p) {
  constexpr bool has_z = detail::dimension<P>() == 3;
  if constexpr (detail::has_point_traits<P>) {
    const auto& v = point_traits<P>::xyz(p);
    if constexpr (has_z)
      return {double(v[0]), double(v[1]), double(v[2])};
    else
      return {double(v[0]), double(v[1]), 0.0};
  } else if constexpr (detail::has_xy_members<P>) {
    if constexpr (has_z)
      return {double(p.x), double(p.y), double(p.z)};
    else
      return {double(p.x), double(p.y), 0.0};
  } else {
    if constexpr (has_z)
      return {double(p[0]), double(p[1]), double(p[2])};
    else
      return {double(p[0]), double(p[1]), 0.0};
  }
}

/// A position that knows how uncertain it is.
template <class P>
concept has_position_sigma = requires(const P& p) {
  { point_traits<P>::position_sigma(p) } -> std::convertible_to<double>;
};

namespace detail {
/// A position that knows how uncertain its height is.
template <class P>
concept has_height_sigma = requires(const P& p) {
  { point_traits<P>::height_sigma(p) } -> std::convertible_to<double>;
};

/// A stem position that knows the direction of its stem.
template <class P>
concept has_axis = requires(const P& p) {
  { point_traits<P>::axis(p)[2] } -> std::convertible_to<double>;
};
}  // namespace detail

/// A stem position that knows how thick the stem is.
template <class P>
concept has_radius = requires(const P& p) {
  { point_traits<P>::radius(p) } -> std::convertible_to<double>;
}
|| (!detail::has_point_traits<P> && requires(const P& p) {
  { p.radius } -> std::convertible_to<double>;
});

namespace detail {
/// Radius [m] as the caller knows it.
template <has_radius P>
double radius_of(const P& p) {
  if constexpr (has_point_traits<P>)
    return double(point_traits<P>::radius(p));
  else
    return double(p.radius);
}
}  // namespace detail

/// Points that are computed from their index: `at(i)` for i in [0, size). The views below are of this type.
template <class At>
class indexed_points {
 public:
  class iterator {
   public:
    using value_type = std::invoke_result_t<const At&, std::size_t>;
    using difference_type = std::ptrdiff_t;
    iterator() = default;
    iterator(const At* at, std::size_t i) : at_(at), i_(i) {}
    value_type operator*() const { return (*at_)(i_); }
    value_type operator[](difference_type n) const { return *(*this + n); }
    iterator& operator+=(difference_type n) {
      i_ += static_cast<std::size_t>(n);
      return *this;
    }
    iterator& operator-=(difference_type n) { return *this += -n; }
    iterator& operator++() { return *this += 1; }
    iterator& operator--() { return *this -= 1; }
    iterator operator++(int) { return {at_, i_++}; }
    iterator operator--(int) { return {at_, i_--}; }
    friend iterator operator+(iterator i, difference_type n) { return i += n; }
    friend iterator operator+(difference_type n, iterator i) { return i += n; }
    friend iterator operator-(iterator i, difference_type n) { return i -= n; }
    friend difference_type operator-(const iterator& a, const iterator& b) {
      return static_cast<difference_type>(a.i_ - b.i_);
    }
    bool operator==(const iterator& other) const { return i_ == other.i_; }
    auto operator<=>(const iterator& other) const { return i_ <=> other.i_; }

   private:
    const At* at_ = nullptr;
    std::size_t i_ = 0;
  };

  indexed_points(std::size_t size, At at) : at_(std::move(at)), size_(size) {}
  iterator begin() const { return {&at_, 0}; }
  iterator end() const { return {&at_, size_}; }
  std::size_t size() const { return size_; }
  auto operator[](std::size_t i) const { return at_(i); }

 private:
  At at_;
  std::size_t size_;
};

namespace detail {

template <class T>
struct strided_reader {
  const std::byte* bytes;
  std::size_t stride;
  std::array<T, 3> operator()(std::size_t i) const {
    std::array<T, 3> p;
    std::memcpy(p.data(), bytes + i * stride, 3 * sizeof(T));  // the stride may leave T unaligned
    return p;
  }
};

template <class T>
struct soa_reader {
  const T *x, *y, *z;
  std::array<T, 3> operator()(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

template <class R>
struct subset_reader {
  const R* points;
  const point_index* indices;
  vec3 operator()(std::size_t i) const {
    return xyz(
        std::ranges::begin(*points)[static_cast<std::ranges::range_difference_t<const R>>(indices[i])]);
  }
};

}  // namespace detail

/// `count` points in raw memory: three consecutive `T` every `stride_bytes` bytes. Refers to the caller's
/// memory. Throws `std::invalid_argument` when the stride cannot hold three coordinates.
template <class T>
auto strided_points(const T* first, std::size_t count, std::size_t stride_bytes = 3 * sizeof(T)) {
  if (stride_bytes < 3 * sizeof(T))
    throw std::invalid_argument("strided_points: stride_bytes holds no three coordinates");
  return indexed_points(count,
                        detail::strided_reader<T>{reinterpret_cast<const std::byte*>(first), stride_bytes});
}

/// Points whose coordinates lie in three arrays (a structure of arrays). Refers to the caller's memory.
/// Throws `std::invalid_argument` when the arrays differ in length.
template <class T>
auto soa_points(std::span<const T> x, std::span<const T> y, std::span<const T> z) {
  if (x.size() != y.size() || x.size() != z.size())
    throw std::invalid_argument("soa_points: x, y and z differ in length");
  return indexed_points(x.size(), detail::soa_reader<T>{x.data(), y.data(), z.data()});
}

/// The points of a random access range at the given indices, in that order. Refers to the caller's memory.
template <std::ranges::random_access_range R>
requires point_range<const R&>
auto subset_points(const R& points, std::span<const point_index> indices) {
  return indexed_points(indices.size(), detail::subset_reader<R>{&points, indices.data()});
}
template <class R>
void subset_points(const R&&, std::span<const point_index>) = delete;  // would refer to a temporary

}  // namespace globalmatch
