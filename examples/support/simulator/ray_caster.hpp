// The nearest surface along a ray: the simulator's one seam to Embree.
#pragma once

#include "support/simulator/surfaces.hpp"

#include "globalmatch/execution.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <limits>
#include <memory>

namespace globalmatch::support {

struct ray {
  Eigen::Vector3d origin;     ///< [m]
  Eigen::Vector3d direction;  ///< a unit vector
};

enum class surface { none, ground, stem, other };

struct hit {
  double range = std::numeric_limits<double>::infinity();  ///< [m] along the ray
  surface what = surface::none;
  std::uint32_t stem = no_stem;
};

/// Surfaces prepared for casting rays; may be shared by threads. It keeps nothing of what it was made from.
class ray_caster {
 public:
  /// Throws `std::runtime_error` when Embree cannot prepare them (for want of memory, say).
  explicit ray_caster(const surfaces& scene, const execution& exec = {});
  ~ray_caster();
  ray_caster(ray_caster&&) noexcept;
  ray_caster& operator=(ray_caster&&) noexcept;

  hit first_hit(const ray& r) const;

 private:
  struct prepared;
  std::unique_ptr<prepared> prepared_;
};

}  // namespace globalmatch::support
