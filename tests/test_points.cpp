#include "globalmatch/points.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>
#include <forward_list>
#include <iterator>
#include <limits>
#include <map>
#include <ranges>
#include <sstream>
#include <tuple>

#include "catch.hpp"
#include "containers.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "support/message_of.hpp"

namespace globalmatch {

using namespace detail;

using support::message_of;

namespace {

struct integer_point {
  std::int64_t x, y, z;
};
struct horizontal_point {
  float x, y;
};
struct named_axes {
  std::string x, y, z;
};
struct accessor_point {
  double x() const { return 1; }
  double y() const { return 2; }
  double z() const { return 3; }
};
/// Members and indices disagree: members win.
struct two_faced_point {
  double x = 1, y = 2, z = 3;
  enum { SizeAtCompileTime = 3 };
  double operator[](int) const { return -1; }
};
/// Members and traits disagree: traits win.
struct traits_and_members {
  double x = 1, y = 2, z = 3;
};
struct thick_point {
  double x, y, z;
  float radius;
};
/// Members are not asked where there are traits.
struct traits_without_radius {
  double x, y, z, radius;
};
struct sphere {
  double x, y, z;
  double radius() const { return 1; }
};
/// A foreign horizontal position.
struct grid_cell {
  int column, row;
};

std::vector<Eigen::Vector3f> random_points(std::uint64_t seed, std::size_t count) {
  random_source random(seed);
  std::vector<Eigen::Vector3f> points(count);
  for (Eigen::Vector3f& p : points)
    for (int i = 0; i < 3; ++i) p[i] = float(100 * random.uniform() - 50);
  return points;
}

}  // namespace

template <>
struct point_traits<traits_and_members> {
  static Eigen::Vector3d xyz(const traits_and_members&) { return {7, 8, 9}; }
};

template <>
struct point_traits<traits_without_radius> {
  static Eigen::Vector3d xyz(const traits_without_radius& p) { return {p.x, p.y, p.z}; }
};

template <>
struct point_traits<grid_cell> {
  static constexpr int dimension = 2;
  static std::array<double, 2> xyz(const grid_cell& c) { return {c.column * 0.5, c.row * 0.5}; }
  static int radius(const grid_cell& c) { return c.row; }
};

TEST_CASE(
    "points are types with members x, y, z, types of a fixed size from 3, and those with point_traits") {
  STATIC_REQUIRE(point<containers::colored_point>);
  STATIC_REQUIRE(point<containers::survey_point>);
  STATIC_REQUIRE(point<containers::pcl_like_point>);
  STATIC_REQUIRE(point<containers::geodetic_mark>);
  STATIC_REQUIRE(point<integer_point>);
  STATIC_REQUIRE(point<std::array<float, 3>>);
  STATIC_REQUIRE(point<std::array<int, 4>>);
  STATIC_REQUIRE(point<double[3]>);
  STATIC_REQUIRE(point<Eigen::Vector3d>);
  STATIC_REQUIRE(point<Eigen::Vector3f>);
  STATIC_REQUIRE(point<Eigen::Vector4f>);
  STATIC_REQUIRE(point<Eigen::RowVector3d>);
  STATIC_REQUIRE(point<Eigen::Array3f>);
  STATIC_REQUIRE(point<Eigen::Matrix3Xd::ColXpr>);
  STATIC_REQUIRE(point<Eigen::Matrix3Xf::ConstColXpr>);
  STATIC_REQUIRE(point<Eigen::Matrix<double, Eigen::Dynamic, 3>::RowXpr>);
  STATIC_REQUIRE(point<const containers::colored_point&>);
  STATIC_REQUIRE(point<Eigen::Vector3d&&>);
}

TEST_CASE("numbers, text, types of a size known at run time only, and horizontal positions are no points") {
  STATIC_REQUIRE_FALSE(point<double>);
  STATIC_REQUIRE_FALSE(point<const float*>);
  STATIC_REQUIRE_FALSE(point<std::string>);
  STATIC_REQUIRE_FALSE(point<std::vector<double>>);
  STATIC_REQUIRE_FALSE(point<std::span<const double>>);
  STATIC_REQUIRE_FALSE(point<std::map<int, double>>);
  STATIC_REQUIRE_FALSE(point<std::tuple<double, double, double>>);
  STATIC_REQUIRE_FALSE(point<std::array<std::string, 3>>);
  STATIC_REQUIRE_FALSE(point<Eigen::VectorXd>);
  STATIC_REQUIRE_FALSE(point<Eigen::Matrix3Xd>);
  STATIC_REQUIRE_FALSE(point<Eigen::Quaterniond>);
  STATIC_REQUIRE_FALSE(point<Eigen::Isometry3d>);
  STATIC_REQUIRE_FALSE(point<named_axes>);
  STATIC_REQUIRE_FALSE(point<accessor_point>);
  STATIC_REQUIRE_FALSE(point<horizontal_point>);
  STATIC_REQUIRE_FALSE(point<grid_cell>);
  STATIC_REQUIRE_FALSE(point<std::array<double, 2>>);
  STATIC_REQUIRE_FALSE(point<Eigen::Vector2d>);
}

TEST_CASE("a square matrix is no point, although its size is fixed") {
  CHECK_FALSE(point<Eigen::Matrix3d>);
  CHECK_FALSE(position<Eigen::Matrix2d>);
}

TEST_CASE("positions are points and what has only x and y") {
  STATIC_REQUIRE(position<horizontal_point>);
  STATIC_REQUIRE(position<grid_cell>);
  STATIC_REQUIRE(position<std::array<double, 2>>);
  STATIC_REQUIRE(position<Eigen::Vector2f>);
  STATIC_REQUIRE(position<Eigen::Matrix2Xd::ColXpr>);
  STATIC_REQUIRE(position<Eigen::Vector3d>);
  STATIC_REQUIRE(position<containers::geodetic_mark>);
  STATIC_REQUIRE_FALSE(position<double>);
  STATIC_REQUIRE_FALSE(position<std::array<double, 1>>);
  STATIC_REQUIRE_FALSE(position<Eigen::VectorXd>);
  STATIC_REQUIRE_FALSE(position<std::pair<double, double>>);
}

TEST_CASE("point ranges can be passed through more than once and hold points") {
  STATIC_REQUIRE(point_range<std::vector<Eigen::Vector3d>>);
  STATIC_REQUIRE(point_range<const std::list<containers::survey_point>&>);
  STATIC_REQUIRE(point_range<std::forward_list<std::array<float, 3>>>);
  STATIC_REQUIRE(point_range<containers::pcl_like_cloud<containers::pcl_like_point>>);
  STATIC_REQUIRE(point_range<double[5][3]>);
  STATIC_REQUIRE(point_range<decltype(std::declval<const Eigen::Matrix3Xd&>().colwise())>);
  STATIC_REQUIRE(point_range<decltype(strided_points(static_cast<const float*>(nullptr), 0))>);
  STATIC_REQUIRE(point_range<std::span<const containers::colored_point>>);
  STATIC_REQUIRE(position_range<std::vector<horizontal_point>>);
  STATIC_REQUIRE_FALSE(point_range<std::vector<horizontal_point>>);
  STATIC_REQUIRE_FALSE(point_range<std::vector<double>>);
  STATIC_REQUIRE_FALSE(point_range<Eigen::Vector3d>);
  STATIC_REQUIRE_FALSE(point_range<Eigen::MatrixXd>);
  STATIC_REQUIRE_FALSE(point_range<decltype(std::declval<const Eigen::MatrixXd&>().colwise())>);
  STATIC_REQUIRE_FALSE(point_range<int>);
}

TEST_CASE("xyz reads the coordinates of every kind of point as doubles") {
  const vec3 expected{1, 2, 3};
  Eigen::Matrix3Xf columns(3, 2);
  columns << 0, 1, 0, 2, 0, 3;
  const double plain[3] = {1, 2, 3};
  CHECK(xyz(containers::colored_point{1, 2, 3, 4, 5, 6}) == expected);
  CHECK(xyz(containers::survey_point{"a", 1, 2, 3}) == expected);
  CHECK(xyz(containers::pcl_like_point{1, 2, 3}) == expected);
  CHECK(xyz(containers::geodetic_mark(1, 2, 3)) == expected);
  CHECK(xyz(integer_point{1, 2, 3}) == expected);
  CHECK(xyz(std::array<float, 3>{1, 2, 3}) == expected);
  CHECK(xyz(std::array<short, 5>{1, 2, 3, 4, 5}) == expected);
  CHECK(xyz(plain) == expected);
  CHECK(xyz(Eigen::Vector3f(1, 2, 3)) == expected);
  CHECK(xyz(Eigen::RowVector4d(1, 2, 3, 4)) == expected);
  CHECK(xyz(columns.col(1)) == expected);
}

TEST_CASE("xyz keeps all digits of doubles and of whole numbers below 2^53") {
  constexpr double third = 1.0 / 3;
  const vec3 p{third, 5300000 + third, -1e300};
  CHECK(xyz(p) == p);
  CHECK(xyz(p.as<Eigen::Vector3d>()) == p);
  CHECK(xyz(containers::survey_point{"", p.x, p.y, p.z}) == p);
  CHECK(xyz(integer_point{9007199254740991, -1, 0}) == vec3{9007199254740991.0, -1, 0});
}

TEST_CASE("xyz gives horizontal positions the height 0") {
  CHECK(xyz(horizontal_point{1, 2}) == vec3{1, 2, 0});
  CHECK(xyz(Eigen::Vector2d(1, 2)) == vec3{1, 2, 0});
  CHECK(xyz(std::array<double, 2>{1, 2}) == vec3{1, 2, 0});
  CHECK(xyz(grid_cell{2, 4}) == vec3{1, 2, 0});
}

TEST_CASE("xyz asks point_traits first, then members, then indices") {
  CHECK(xyz(traits_and_members{}) == vec3{7, 8, 9});
  CHECK(xyz(two_faced_point{}) == vec3{1, 2, 3});
}

TEST_CASE("a radius is that of point_traits where there are any, else a member that is a number") {
  STATIC_REQUIRE(has_radius<thick_point>);
  STATIC_REQUIRE(has_radius<grid_cell>);
  STATIC_REQUIRE_FALSE(has_radius<traits_without_radius>);
  STATIC_REQUIRE_FALSE(has_radius<sphere>);
  STATIC_REQUIRE_FALSE(has_radius<integer_point>);
  STATIC_REQUIRE_FALSE(has_radius<Eigen::Vector3d>);
  CHECK(radius_of(thick_point{1, 2, 3, 0.25f}) == 0.25);
  CHECK(radius_of(grid_cell{2, 4}) == 4);
}

TEST_CASE("every kind of container yields the same coordinates in the same order") {
  const std::vector<Eigen::Vector3f> points = random_points(1, 100);
  containers::for_each_container(points, [&](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    STATIC_REQUIRE(point_range<decltype(range)>);
    std::size_t count = 0, equal = 0;
    for (const auto& p : range) {
      equal += xyz(p) == vec3::from(points[count]) ? 1 : 0;
      ++count;
    }
    CHECK(count == points.size());
    CHECK(equal == points.size());
  });
}

TEST_CASE("empty containers of every kind are ranges without points") {
  containers::for_each_container({}, [](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    CHECK(std::ranges::begin(range) == std::ranges::end(range));
  });
}

TEST_CASE("indexed points can be passed through twice, by index too") {
  const std::vector<float> numbers = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  const auto points = strided_points(numbers.data(), 3);
  STATIC_REQUIRE(std::forward_iterator<decltype(points.begin())>);
  CHECK(points.size() == 3);
  for (int pass = 0; pass < 2; ++pass) {
    std::size_t i = 0;
    for (auto at = points.begin(); at != points.end(); at++, ++i) CHECK(*at == points[i]);
    CHECK(i == 3);
  }
  CHECK(points[2] == std::array<float, 3>{6, 7, 8});
}

// clang 14 and 15 do not compile the views of libstdc++ 12.
#if !defined(__clang__) || __clang_major__ >= 16
TEST_CASE("views that have a const begin are point ranges, also of temporaries") {
  const std::vector<float> x = {1, 2, 3}, y = {4, 5, 6}, z = {7, 8, 9};
  const std::span<const float> xs(x), ys(y), zs(z);
  const auto first_two = soa_points(xs, ys, zs) | std::views::take(2);
  const auto first = strided_points(x.data(), 1) | std::views::take(1);
  const auto shifted = soa_points(xs, ys, zs) | std::views::transform([](const std::array<float, 3>& p) {
                         return std::array<float, 3>{p[0] + 10, p[1], p[2]};
                       });
  STATIC_REQUIRE(point_range<decltype(first_two)>);
  STATIC_REQUIRE(point_range<decltype(shifted)>);
  std::vector<vec3> seen;
  for (const auto& p : first_two) seen.push_back(xyz(p));
  for (const auto& p : first) seen.push_back(xyz(p));
  for (const auto& p : shifted) seen.push_back(xyz(p));
  CHECK(seen == std::vector<vec3>{{1, 4, 7}, {2, 5, 8}, {1, 2, 3}, {11, 4, 7}, {12, 5, 8}, {13, 6, 9}});
}

TEST_CASE("views without a const begin are no point ranges, although forward ranges") {
  std::vector<Eigen::Vector3d> points(3);
  const auto low = [](const Eigen::Vector3d& p) { return p.z() < 1; };
  STATIC_REQUIRE(std::ranges::forward_range<decltype(points | std::views::filter(low))>);
  STATIC_REQUIRE_FALSE(point_range<decltype(points | std::views::filter(low))>);
  STATIC_REQUIRE_FALSE(point_range<decltype(points | std::views::drop_while(low))>);
  STATIC_REQUIRE_FALSE(position_range<decltype(points | std::views::filter(low))>);
}
#endif

TEST_CASE("strided_points reads interleaved records that need not be aligned") {
  struct record {
    char flag;
    double x, y, z;
    float intensity;
  };
  const std::vector<record> records = {{'a', 1, 2, 3, 0.5f}, {'b', 4, 5, 6, 0.5f}};
  const auto points = strided_points(&records[0].x, records.size(), sizeof(record));
  CHECK(points[0] == std::array<double, 3>{1, 2, 3});
  CHECK(points[1] == std::array<double, 3>{4, 5, 6});
}

TEST_CASE("strided_points refuses a stride that holds no three coordinates") {
  const float numbers[6] = {};
  CHECK(message_of([&] { strided_points(numbers, 2, 11); }).starts_with("strided_points: stride_bytes"));
  CHECK(message_of([&] { strided_points(numbers, 2, 0); }).starts_with("strided_points: stride_bytes"));
  CHECK(message_of([&] { strided_points(numbers, 2, 12); }).empty());
}

TEST_CASE("soa_points refuses arrays of different lengths") {
  const std::vector<double> two(2), three(3);
  const auto message = [](const auto& x, const auto& y, const auto& z) {
    return message_of([&] {
      soa_points(std::span<const double>(x), std::span<const double>(y), std::span<const double>(z));
    });
  };
  CHECK(message(two, two, three).starts_with("soa_points: x, y and z"));
  CHECK(message(two, three, two).starts_with("soa_points: x, y and z"));
  CHECK(message(three, two, two).starts_with("soa_points: x, y and z"));
  CHECK(message(two, two, two).empty());
}

TEST_CASE("subset_points yields the points at the indices, in their order, repeated ones too") {
  const std::vector<Eigen::Vector3f> points = random_points(2, 20);
  const std::vector<point_index> indices = {7, 0, 19, 7};
  const auto subset = subset_points(points, std::span(indices));
  STATIC_REQUIRE(point_range<decltype(subset)>);
  REQUIRE(subset.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) CHECK(subset[i] == vec3::from(points[indices[i]]));
  CHECK(subset_points(points, std::span<const point_index>()).size() == 0);
}

TEST_CASE("not a number and infinity are read as they are") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                  infinity = std::numeric_limits<float>::infinity();
  const vec3 p = xyz(containers::colored_point{nan, infinity, -infinity, 0, 0, 0});
  CHECK(std::isnan(p.x));
  CHECK(p.y == double(infinity));
  CHECK(p.z == -double(infinity));
}

}  // namespace globalmatch
