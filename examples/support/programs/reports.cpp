#include "support/programs/reports.hpp"

#include <globalmatch/detail/mapping/scan_units.hpp>
#include <globalmatch/registration.hpp>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/scan_files.hpp"
#include "support/transform_files.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <sstream>
#include <system_error>

namespace globalmatch::support {

using json = nlohmann::ordered_json;

execution stage_clock::listen(int threads) {
  execution exec;
  exec.threads = threads;
  exec.on_progress = [this](const progress& p) {
    enter(p.stage);
    bar_.show(p);
    return true;
  };
  return exec;
}

void stage_clock::enter(std::string_view stage) {
  const auto now = clock::now();
  if (current_) stages_[*current_].second += std::chrono::duration<double>(now - last_).count();
  last_ = now;
  const auto known =
      std::find_if(stages_.begin(), stages_.end(), [&](const auto& s) { return s.first == stage; });
  current_ = std::size_t(known - stages_.begin());
  if (known == stages_.end()) stages_.emplace_back(stage, 0.0);
}

void stage_clock::leave() {
  bar_.clear();
  if (current_) stages_[*current_].second += std::chrono::duration<double>(clock::now() - last_).count();
  current_.reset();
}

double stage_clock::seconds() const {
  return std::chrono::duration<double>(clock::now() - start_).count();
}

json stage_clock::stages() {
  leave();
  json result = json::object();
  for (const auto& [name, seconds] : stages_) result[name] = seconds;
  return result;
}

namespace {

/// [rad]
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

json as_json(const std::vector<funnel_step>& steps) {
  json table = json::array();
  for (const funnel_step& s : steps)
    table.push_back({{"step", s.step},
                     {"input", s.of},
                     {"input_count", s.in},
                     {"output", s.what},
                     {"output_count", s.out},
                     {"dropped_because", s.rest}});
  return table;
}

json row_by_row(const Eigen::MatrixXd& matrix) {
  json numbers = json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r)
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) numbers.push_back(matrix(r, c));
  return numbers;
}

json row_by_row(const Eigen::Isometry3d& transform) {
  return row_by_row(Eigen::MatrixXd(transform.matrix()));
}

json describe(const ground_funnel& f) {
  return {{"not_finite", f.not_finite},
          {"low_points", f.low_points},
          {"cells", f.cells},
          {"cells_apart", f.cells_apart},
          {"low_outliers", f.low_outliers},
          {"coordinate_step", f.coordinate_step},
          {"unreachable", f.unreachable},
          {"ground_points", f.ground_points}};
}

json describe(const hypothesis& h) {
  return {{"matches", h.correspondences.size()},
          {"rms", h.rms},
          {"inlier_threshold", h.inlier_threshold},
          {"log10_nfa", h.log10_nfa},
          {"log10_nfa_poisson", h.log10_nfa_poisson},
          {"evidence_source", to_string(h.evidence)},
          {"consensus", h.consensus},
          {"target_from_source", row_by_row(h.target_from_source)}};
}

json describe(const transform_uncertainty& u) {
  return {{"center", row_by_row(Eigen::MatrixXd(u.center))},
          {"up", row_by_row(Eigen::MatrixXd(u.up))},
          {"covariance", row_by_row(Eigen::MatrixXd(u.covariance))},
          {"expected_error", u.expected_error(u.center)}};
}

json describe(const planting_lattice& lattice) {
  return {{"spacing", {lattice.first.norm(), lattice.second.norm()}},
          {"direction_deg", lattice.direction() * 180 / std::numbers::pi},
          {"angle_deg", lattice.angle() * 180 / std::numbers::pi}};
}

/// Degrees of freedom of the transform; null where there is none.
json dof_of(const matching& result) {
  if (!result.vertical) return nullptr;
  return result.vertical->kind == vertical_kind::rotated ? 6 : 4;
}

json describe(const vertical_fit& fit) {
  return {{"status", fit.is_known() ? "known" : "unknown"},
          {"source", to_string(fit.source)},
          {"kind", to_string(fit.kind)},
          {"sigma", fit.is_known() ? json(fit.sigma) : json(nullptr)},
          {"tilt_deg", fit.tilt * 180 / std::numbers::pi},
          {"reason", fit.reason}};
}

json describe(const scale_estimate& scale) {
  return {{"factor", scale.factor},
          {"sigma", scale.sigma},
          {"differs", scale.differs},
          {"applied", scale.is_applied}};
}

json describe(const prior_deviation& prior) {
  return {{"distance", prior.distance},
          {"turn_deg", prior.turn * 180 / std::numbers::pi},
          {"sigmas", prior.sigmas},
          {"contradicted", prior.is_contradicted}};
}

}  // namespace

json describe(const stem_map& map) {
  const auto upright = [&]() -> json {
    if (!map.upright) return nullptr;
    const double degrees = 180 / std::numbers::pi;
    return {{"up", row_by_row(Eigen::MatrixXd(map.upright->up))},
            {"sigma_deg", degrees * map.upright->sigma},
            {"tilt_deg", degrees * angle_between(map.upright->up, map.given_up)},
            {"tilted", is_tilted(map)}};
  };
  return {{"points", map.funnel.ground.points - map.funnel.ground.not_finite},
          {"stems", map.funnel.stems},
          {"funnel", as_json(explain(map.funnel))},
          {"ground", describe(map.funnel.ground)},
          {"ground_status", to_string(map.terrain.status)},
          {"cut_off", map.terrain.cut_off},
          {"up", row_by_row(Eigen::MatrixXd(map.up))},
          {"up_by_stems", map.up_by_stems},
          {"seen_from_scanner", !map.visible.empty()},
          {"upright", upright()},
          {"spacing_near", map.spacing_near},
          {"spacing_far", map.spacing_far},
          {"distance_tolerance", map.distance_tolerance}};
}

std::vector<warning> warnings_of(const stem_map& map, const marked_points& marked, bool keeps_marked) {
  std::vector<warning> warnings = warnings_of(map);
  if (marked.noise + marked.withheld > 0)
    warnings.insert(
        warnings.begin(),
        {"marked_points", std::to_string(marked.noise) + " points are marked as noise and " +
                              std::to_string(marked.withheld) + " others as withheld; they were " +
                              (keeps_marked ? "kept" : "left out (--keep-noise reads them)")});
  return warnings;
}

namespace {

// Of a scan without stems whether it is as high as trees, and no wider in plan than a twig: 2 km are 0.02
// degrees.
bool looks_like_degrees(const scan_file& scan) {
  constexpr double max_width = 0.02, min_height = 1;
  const std::vector<detail::vec3> points = detail::points_all_over(scan);
  if (points.empty()) return false;
  const double x = detail::robust_range(points, 0).width(), y = detail::robust_range(points, 1).width();
  return x > 0 && y > 0 && std::max(x, y) < max_width && detail::robust_range(points, 2).width() > min_height;
}

}  // namespace

std::vector<warning> warnings_of(const stem_map& map, const scan_file& scan, bool keeps_marked) {
  std::vector<warning> warnings = warnings_of(map, scan.marked(), keeps_marked);
  if (map.stems.empty() && looks_like_degrees(scan))
    warnings.insert(warnings.begin(),
                    {"degrees", "are coordinates in degrees? Project them: metres are needed, as in UTM"});
  for (const std::string& note : scan.header().notes) warnings.insert(warnings.begin(), {"scan_file", note});
  return warnings;
}

std::vector<warning> warnings_of(const stem_table& table) {
  std::vector<warning> warnings;
  for (const std::string& note : table.notes) warnings.push_back({"stem_file", note});
  return warnings;
}

void print(const std::vector<warning>& warnings) {
  for (const warning& w : warnings) std::cerr << w.text << '\n';
}

void print(const std::vector<warning>& warnings, const std::filesystem::path& scan) {
  for (const warning& w : warnings) std::cerr << scan.filename().string() << ": " << w.text << '\n';
}

json describe(const std::vector<warning>& warnings) {
  json list = json::array();
  for (const warning& w : warnings) list.push_back({{"code", w.code}, {"text", w.text}});
  return list;
}

void warn_if_tilted(const stem_map& map, const std::filesystem::path& scan) {
  if (is_tilted(map)) std::cerr << scan.filename().string() << ": its stems " << describe_tilt(map) << '\n';
}

std::optional<Eigen::Isometry3d> with_scale(const matching& result) {
  std::optional<Eigen::Isometry3d> transform = result.target_from_source;
  if (transform && result.scale && result.scale->is_applied) transform->linear() *= result.scale->factor;
  return transform;
}

json describe(const matching& result, const std::optional<Eigen::Isometry3d>& target_from_source) {
  json hypotheses = json::array();
  for (hypothesis h : result.hypotheses) {
    if (result.scale && result.scale->is_applied) h.target_from_source.linear() *= result.scale->factor;
    hypotheses.push_back(describe(h));
  }
  json uncertainty = result.uncertainty ? describe(*result.uncertainty) : json(nullptr);
  if (result.vertical && !result.vertical->is_known()) uncertainty["expected_error"] = nullptr;
  return {{"matches", result.funnel.correspondences},
          {"outcome", to_string(result.outcome)},
          {"reason", result.reason},
          {"probability", result.probability},
          {"target_from_source", target_from_source ? row_by_row(*target_from_source) : json(nullptr)},
          {"uncertainty", std::move(uncertainty)},
          {"hypotheses", std::move(hypotheses)},
          {"lattice", result.lattice ? describe(*result.lattice) : json(nullptr)},
          {"inlier_threshold", result.inlier_threshold},
          {"scale", result.scale ? describe(*result.scale) : json(nullptr)},
          {"prior", result.prior ? describe(*result.prior) : json(nullptr)},
          {"dof", dof_of(result)},
          {"vertical", result.vertical ? describe(*result.vertical) : json(nullptr)},
          {"warnings", describe(warnings_of(result))},
          {"funnel", as_json(explain(result.funnel))}};
}

void write_json(const std::filesystem::path& path, const json& report) {
  if (path.empty()) return;
  atomic_file file(path);
  file.stream() << report.dump(2, ' ', false, json::error_handler_t::replace) << '\n';
  file.commit();
}

void write_or_remove_transform(const std::filesystem::path& path,
                               const std::optional<Eigen::Isometry3d>& target_from_source) {
  if (target_from_source) {
    write_transform(path, *target_from_source);
    return;
  }
  std::error_code absent, error;
  if (std::filesystem::is_regular_file(path, absent)) std::filesystem::remove(path, error);
  if (error)
    throw file_error(path, "an earlier result cannot be removed",
                     "Remove it by hand: it is not of these scans.");
}

std::string summary(const matching& result) {
  std::ostringstream line;
  line << to_string(result.outcome);
  if (!result.reason.empty()) line << ": " << result.reason;
  if (result.outcome == outcome::registered)
    line << ": " << result.funnel.correspondences << " of " << result.funnel.source_stems << " and "
         << result.funnel.target_stems << " stems matched";
  if (result.uncertainty) {
    const Eigen::Matrix3d at_center = result.uncertainty->at(result.uncertainty->center);
    const Eigen::Vector3d& up = result.uncertainty->up;
    const double horizontal = std::sqrt(std::max(0.0, at_center.trace() - up.dot(at_center * up)));
    line << std::setprecision(2) << ", standard error by the stems alone " << 100 * horizontal
         << " cm in plan";
  }
  if (result.vertical && result.vertical->is_known())
    line << ", of the height by " << (result.vertical->source == vertical_source::ground ? "ground" : "stems")
         << " " << 100 * result.vertical->sigma << " cm";
  if (result.outcome == outcome::registered && result.hypotheses.front().evidence != evidence_source{})
    line << "; " << to_string(result.hypotheses.front().evidence)
         << " in the plantation resolved the ambiguity";
  return line.str();
}

}  // namespace globalmatch::support
