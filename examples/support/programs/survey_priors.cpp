#include "support/programs/survey_priors.hpp"

#include <cmath>
#include <numbers>

#include "support/programs/named_table.hpp"

namespace globalmatch::support {

namespace {

named_prior prior_of(const named_row& row) {
  constexpr double degree = std::numbers::pi / 180;
  named_prior prior;
  prior.scan = row.text("scan");
  survey_options::prior& p = prior.measured;
  p.position = {row.number("x"), row.number("y"), row.number("z")};
  if (std::isnan(p.position.x()) != std::isnan(p.position.y())) row.fail("x and y are known both or neither");
  p.yaw = row.number("yaw_deg") * degree;
  p.sigma_plan = row.sigma("sigma_xy", !std::isnan(p.position.x()));
  p.sigma_height = row.sigma("sigma_z", !std::isnan(p.position.z()));
  p.sigma_yaw = row.sigma("sigma_yaw_deg", !std::isnan(p.yaw)) * degree;
  return prior;
}

}  // namespace

std::vector<named_prior> read_priors(const std::filesystem::path& file) {
  std::vector<named_prior> priors;
  for (const named_row& row :
       read_named_table(file, {"scan", "x", "y", "z", "yaw_deg", "sigma_xy", "sigma_z", "sigma_yaw_deg"}))
    priors.push_back(prior_of(row));
  return priors;
}

}  // namespace globalmatch::support
