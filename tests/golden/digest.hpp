// Digests of results over a fixed set of inputs, one line each: what changes no result changes no line.
// Each is computed with one thread and with four, which must agree.
#pragma once

#include <globalmatch/stem_matching.hpp>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <bit>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <string>
#include <vector>

namespace globalmatch::golden {

/// FNV-1a over the bytes of numbers.
class digest {
 public:
  void add(std::uint64_t bits) {
    for (int byte = 0; byte < 8; ++byte) {
      value_ = (value_ ^ (bits & 255)) * 0x100000001b3u;
      bits >>= 8;
    }
  }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(const Eigen::Vector3d& v) {
    for (int i = 0; i < 3; ++i) add(v[i]);
  }
  void add(const Eigen::Isometry3d& transform) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) add(transform(r, c));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// Of a whole result, and of its outcome and transform alone.
struct digests {
  digest everything, outcome;
  bool operator==(const digests& other) const {
    return everything.value() == other.everything.value() && outcome.value() == other.outcome.value();
  }
};

inline digests digest_of(const matching& m) {
  digests d;
  d.outcome.add(std::uint64_t(m.outcome));
  d.outcome.add(m.target_from_source.value_or(Eigen::Isometry3d::Identity()));
  d.everything.add(d.outcome.value());
  d.everything.add(m.probability);
  d.everything.add(m.inlier_threshold);
  for (const hypothesis& h : m.hypotheses) {
    d.everything.add(h.target_from_source);
    for (const correspondence& c : h.correspondences) {
      d.everything.add(std::uint64_t(c.source));
      d.everything.add(std::uint64_t(c.target));
    }
    for (const double number : {h.inlier_threshold, h.log10_nfa, h.log10_nfa_poisson, h.rms})
      d.everything.add(number);
  }
  if (m.uncertainty) {
    d.everything.add(m.uncertainty->center);
    for (Eigen::Index r = 0; r < m.uncertainty->covariance.rows(); ++r)
      for (Eigen::Index c = 0; c < m.uncertainty->covariance.cols(); ++c)
        d.everything.add(m.uncertainty->covariance(r, c));
  }
  return d;
}

/// Whether all results were the same with one thread and with four.
inline bool threads_agree = true;

/// Prints the digests that `compute(execution)` returns.
template <class Compute>
void print(const std::string& name, const Compute& compute) {
  const digests one = compute(execution{1}), four = compute(execution{4});
  if (!(one == four)) {
    std::cerr << name << ": four threads give other bits than one\n";
    threads_agree = false;
  }
  std::cout << name << std::hex << std::setfill('0') << ' ' << std::setw(16) << one.outcome.value() << ' '
            << std::setw(16) << one.everything.value() << std::dec << std::endl;
}

}  // namespace globalmatch::golden
