// What registrations and stem maps say against a truth, as evaluate_dataset reports it.
#include <Eigen/Geometry>

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "catch.hpp"
#include "dataset/truth_doubts.hpp"

namespace globalmatch::test_dataset_doubts {

using namespace benchmarks;
using Catch::Matchers::Contains;
using Eigen::Isometry3d;

namespace {

const std::vector<std::string> names = {"a", "b", "c", "d"};

std::vector<std::optional<Isometry3d>> four_poses() {
  const auto at = [](double x, double y, double yaw) {
    return Isometry3d(Eigen::Translation3d(x, y, 0.5) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  };
  return {at(0, 0, 0.3), at(11, 2, 2), at(14, 10, -1), at(3, 12, 0.7)};
}

/// All pairs, registered as they are.
std::vector<true_pair> registrations() {
  const true_transforms truth(four_poses());
  std::vector<true_pair> pairs;
  for (std::size_t target = 0; target < truth.size(); ++target)
    for (std::size_t source = target + 1; source < truth.size(); ++source)
      pairs.push_back({source, target, truth.target_from_source(source, target)});
  return pairs;
}

truth_doubts doubts(const true_transforms& truth,
                    const std::vector<true_pair>& registered = registrations()) {
  return doubts_of("plot", names, truth, registered, [](const true_transforms& t, const true_pair& pair) {
    return !difference(t.target_from_source(pair.source, pair.target), pair.target_from_source)
                .is_contradiction();
  });
}

using change = std::function<Isometry3d(const Isometry3d&)>;

const change inverse = [](const Isometry3d& t) { return t.inverse(); };
const change transposed = [](Isometry3d t) {
  t.linear() = t.linear().transpose().eval();
  return t;
};
const change in_millimetres = [](Isometry3d t) {
  t.translation() *= 1000;
  return t;
};

}  // namespace

TEST_CASE("a truth that registrations agree with raises no doubt, nor does one without registrations") {
  CHECK(doubts(true_transforms(four_poses())).texts.empty());
  const truth_doubts none = doubts(true_transforms(four_poses()).with_each(inverse), {});
  CHECK(none.texts.empty());
  CHECK(!none.is_refuted);
}

TEST_CASE("the mistake that a truth is published with is named, for poses and for pairs") {
  const true_transforms of_poses(four_poses());
  const true_transforms of_pairs(4, {{1, 0, of_poses.target_from_source(1, 0)},
                                     {2, 0, of_poses.target_from_source(2, 0)},
                                     {3, 1, of_poses.target_from_source(3, 1)}});
  for (const true_transforms& truth : {of_poses, of_pairs})
    for (const auto& [mistake, text] :
         {std::pair(inverse, "--inverse-truth"), std::pair(transposed, "transposed"),
          std::pair(in_millimetres, "millimetres")}) {
      const truth_doubts found = doubts(truth.with_each(mistake));
      REQUIRE(found.texts.size() == 1);
      CHECK_THAT(found.texts[0], Contains("plot") && Contains("contradicts all 6") && Contains(text));
      CHECK(found.is_refuted);
    }
}

TEST_CASE("a truth that no registration agrees with is refuted by several, and doubted by one") {
  auto poses = four_poses();
  std::swap(poses[0], poses[1]);
  std::swap(poses[2], poses[3]);
  poses[0]->translation().x() += 3;
  poses[2]->translation().y() += 5;
  const true_transforms wrong(poses);
  CHECK(doubts(wrong).is_refuted);
  CHECK_THAT(doubts(wrong).texts.at(0), Contains("order of the scans"));
  const truth_doubts one = doubts(wrong, {registrations()[0]});
  CHECK(!one.is_refuted);
  CHECK(one.texts.size() == 1);
}

TEST_CASE("a scan is named where its own truth contradicts all its registrations") {
  auto poses = four_poses();
  poses[2]->translation().x() += 5;
  const truth_doubts found = doubts(true_transforms(poses));
  REQUIRE(found.texts.size() == 1);
  CHECK_THAT(found.texts[0], Contains("truth of c contradicts all 3"));
  CHECK(!found.is_refuted);
}

TEST_CASE("true stems are doubted where next to no find is one of them") {
  map_score wrong, right;
  wrong.found = 60;
  wrong.true_finds = 2;
  right.found = right.true_finds = 60;
  CHECK_THAT(doubt_of_stems("plot", {wrong, wrong}).value(), Contains("of 120 stems found 4"));
  CHECK(!doubt_of_stems("plot", {wrong, right}));
  CHECK(!doubt_of_stems("plot", {}));
}

}  // namespace globalmatch::test_dataset_doubts
