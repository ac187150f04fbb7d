#include "unit.hpp"

#include <globalmatch/execution.hpp>
#include <globalmatch/detail/core/random.hpp>
#include <globalmatch/stem_matching.hpp>

#include <cmath>

namespace {

std::vector<double> match_made_up_maps(const globalmatch::execution& exec) {
  globalmatch::random_source random(1);
  std::vector<Eigen::Vector3d> source, target;
  for (int i = 0; i < 12; ++i) {
    const double x = 20 * random.uniform(), y = 20 * random.uniform(), noise = 0.01 * random.uniform();
    source.push_back({x, y, 0});
    target.push_back({y + noise, -x, 1});
  }
  const auto result = globalmatch::match_stems(source, target, {}, Eigen::Vector3d::UnitZ(), exec);
  if (!result.target_from_source) return {};
  const Eigen::Matrix4d& transform = result.target_from_source->matrix();
  return {transform.data(), transform.data() + transform.size()};
}

}  // namespace

unit_result UNIT::compute() {
  const globalmatch::execution exec{.threads = 3, .on_progress = {}};
  const std::size_t count = 10000, chunk = 100;
  unit_result result{std::vector<double>(count / chunk), match_made_up_maps(exec),
                     globalmatch::thread_count(exec)};
  globalmatch::parallel_chunks(exec, "sums", count, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result.chunk_sums[begin / chunk] += std::sqrt(double(i));
  });
  return result;
}
