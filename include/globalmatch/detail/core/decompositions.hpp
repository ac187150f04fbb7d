// Eigenvalues of small symmetric matrices in closed form, and the rotation nearest to a matrix. They have the
// bits of Eigen 3.4's computeDirect and JacobiSVD.
#pragma once

#include <utility>

#include "globalmatch/detail/core/matrices.hpp"

namespace globalmatch::detail {

/// Eigenvalues, ascending, each with its unit vector as a column.
struct eigen_of_mat2 {
  vec2 values;
  mat2 vectors = mat2::identity();
};
struct eigen_of_mat3 {
  vec3 values;
  mat3 vectors = mat3::identity();
};

constexpr double machine_epsilon = 0x1p-52;

/// Of a symmetric matrix, whose lower triangle is read.
inline eigen_of_mat2 symmetric_eigen(const mat2& matrix) {
  // Shifted to trace zero and scaled to one: no overflow, and no digits lost to a common part.
  const double shift = matrix.trace() / 2, off = matrix(1, 0);
  double a = matrix(0, 0) - shift, b = off, c = matrix(1, 1) - shift;
  const double scale = vec3{a, b, c}.max_abs();
  if (scale > 0) a /= scale, b /= scale, c /= scale;
  const double half_gap = 0.5 * std::sqrt((a - c) * (a - c) + 4 * (b * b)), middle = 0.5 * (a + c);
  eigen_of_mat2 result;
  vec2& values = result.values;
  values = {middle - half_gap, middle + half_gap};
  if (values.y - values.x > std::abs(values.y) * machine_epsilon) {
    a -= values.y;
    c -= values.y;
    const vec2 across = a * a > c * c ? vec2{-b, a} : vec2{-c, b};  // to the longer row
    const vec2 v = across / std::sqrt(a * a > c * c ? a * a + b * b : c * c + b * b);
    result.vectors = {{vec2{-v.y, v.x}.normalized(), v}};
  }
  values = {values.x * scale + shift, values.y * scale + shift};
  return result;
}

/// Roots, ascending, of the characteristic polynomial x^3 - c2 x^2 + c1 x - c0, by trigonometry (Smith 1961).
inline vec3 characteristic_roots(const mat3& m) {
  constexpr double third = 1.0 / 3;
  const double root_of_3 = std::sqrt(3.0), xx = m(0, 0), yy = m(1, 1), zz = m(2, 2), yx = m(1, 0),
               zx = m(2, 0), zy = m(2, 1);
  const double c0 = xx * yy * zz + 2 * yx * zx * zy - xx * zy * zy - yy * zx * zx - zz * yx * yx;
  const double c1 = xx * yy - yx * yx + xx * zz - zx * zx + yy * zz - zy * zy;
  const double c2 = xx + yy + zz;
  const double center = c2 * third;
  const double a = (c2 * center - c1) * third, a_over_3 = a < 0 ? 0 : a;
  const double half_b = 0.5 * (c0 + center * (2 * center * center - c1));
  const double q = a_over_3 * a_over_3 * a_over_3 - half_b * half_b;
  const double radius = std::sqrt(a_over_3), angle = std::atan2(std::sqrt(q < 0 ? 0 : q), half_b) * third;
  const double cosine = std::cos(angle), sine = std::sin(angle);
  return {center - radius * (cosine + root_of_3 * sine), center - radius * (cosine - root_of_3 * sine),
          center + 2 * radius * cosine};
}

/// A unit vector that a symmetric matrix of rank two takes to zero, and a column of the matrix, across it.
struct kernel_of_mat3 {
  vec3 vector, across;

  explicit kernel_of_mat3(const mat3& m) {
    int longest = std::abs(m(1, 1)) > std::abs(m(0, 0)) ? 1 : 0;
    if (std::abs(m(2, 2)) > std::abs(m(longest, longest))) longest = 2;
    across = m.col(longest);
    const vec3 a = across.cross(m.col((longest + 1) % 3)), b = across.cross(m.col((longest + 2) % 3));
    const double squared_a = a.squared_norm(), squared_b = b.squared_norm();
    vector = squared_a > squared_b ? a / std::sqrt(squared_a) : b / std::sqrt(squared_b);
  }
};

/// Unit vectors of a symmetric matrix that is scaled to one, for its ascending eigenvalues.
inline mat3 eigenvectors_of_scaled(const mat3& matrix, const vec3& values) {
  if (values.z - values.x <= machine_epsilon) return mat3::identity();
  const auto without = [&](double value) {
    return kernel_of_mat3(mat3{{{matrix(0, 0) - value, matrix(1, 0), matrix(2, 0)},
                                {matrix(0, 1), matrix(1, 1) - value, matrix(2, 1)},
                                {matrix(0, 2), matrix(1, 2), matrix(2, 2) - value}}});
  };
  const double upper_gap = values.z - values.y, lower_gap = values.y - values.x;
  const bool upper_first = upper_gap > lower_gap;  // the most distinct one
  const int first = upper_first ? 2 : 0, other = 2 - first;
  const double wide = lower_gap, narrow = upper_first ? lower_gap : upper_gap;
  mat3 vectors;
  const kernel_of_mat3 distinct = without(values[first]);
  vectors.columns[first] = distinct.vector;
  if (narrow <= 2 * machine_epsilon * wide) {  // the other two are equal: any vector across the first
    const vec3& v = distinct.across;
    vectors.columns[other] = (v - distinct.vector.dot(v) * v).normalized();
  } else {
    vectors.columns[other] = without(values[other]).vector;
  }
  vectors.columns[1] = vectors.columns[2].cross(vectors.columns[0]).normalized();
  return vectors;
}

/// Of a symmetric matrix, whose lower triangle is read.
inline eigen_of_mat3 symmetric_eigen(const mat3& matrix) {
  const double shift = matrix.trace() / 3;
  const double a = matrix(1, 0), b = matrix(2, 0), c = matrix(2, 1);
  const vec3 diagonal = matrix.diagonal() - vec3{shift, shift, shift};
  mat3 scaled{{{diagonal.x, a, b}, {a, diagonal.y, c}, {b, c, diagonal.z}}};
  const double most = diagonal.max_abs(), off = vec3{a, b, c}.max_abs(), scale = most < off ? off : most;
  if (scale > 0) scaled /= scale;
  const vec3 values = characteristic_roots(scaled);
  return {values * scale + vec3{shift, shift, shift}, eigenvectors_of_scaled(scaled, values)};
}

/// A rotation in the plane of two coordinates.
struct plane_rotation {
  double c = 1, s = 0;

  plane_rotation transpose() const { return {c, -s}; }
  void apply(double& x, double& y) const {
    const double old_x = x, old_y = y;
    x = c * old_x + s * old_y;
    y = -s * old_x + c * old_y;
  }
  void apply(vec3& x, vec3& y) const {
    for (int i = 0; i < 3; ++i) apply(x[i], y[i]);
  }
  friend plane_rotation operator*(const plane_rotation& a, const plane_rotation& b) {
    return {a.c * b.c - a.s * b.s, a.c * b.s + a.s * b.c};
  }
  /// Makes the symmetric matrix of x, y and y, z diagonal, from both sides.
  static plane_rotation diagonalizing(double x, double y, double z) {
    if (2 * std::abs(y) < 0x1p-1022) return {};
    const double tau = (x - z) / (2 * std::abs(y)), w = std::sqrt(tau * tau + 1);
    const double t = 1 / (tau > 0 ? tau + w : tau - w), n = 1 / std::sqrt(t * t + 1);
    return {n, -(t > 0 ? 1 : -1) * (y / std::abs(y)) * std::abs(t) * n};
  }
};

/// Singular values, descending, with matrix = u * diagonal(values) * v.transpose().
struct svd_of_mat3 {
  mat3 u = mat3::identity(), v = mat3::identity();
  vec3 values;

  /// Two-sided Jacobi rotations (Golub and Van Loan). The matrix must be finite.
  explicit svd_of_mat3(const mat3& matrix) {
    double scale = 0;
    for (const vec3& column : matrix.columns) scale = scale < column.max_abs() ? column.max_abs() : scale;
    if (!(scale > 0)) return;
    mat3 work = matrix / scale;
    while (sweep(work)) {
    }
    for (int i = 0; i < 3; ++i) {
      values[i] = std::abs(work(i, i)) * scale;
      if (work(i, i) < 0) u.columns[i] = -u.columns[i];
    }
    for (int i = 0; i < 2; ++i) {
      int largest = i;
      for (int j = i + 1; j < 3; ++j)
        if (values[j] > values[largest]) largest = j;
      if (largest == i) continue;
      std::swap(values[i], values[largest]);
      std::swap(u.columns[i], u.columns[largest]);
      std::swap(v.columns[i], v.columns[largest]);
    }
  }

 private:
  /// Whether there was anything left to rotate away.
  bool sweep(mat3& work) {
    bool rotated = false;
    for (int p = 1; p < 3; ++p)
      for (int q = 0; q < p; ++q) {
        // The diagonal only grows, as far as it is looked at: Eigen's bound, with its bits.
        const double bound = 2 * machine_epsilon * max_on_diagonal(work);
        const double threshold = bound < 0x1p-1022 ? 0x1p-1022 : bound;
        if (!(std::abs(work(p, q)) > threshold || std::abs(work(q, p)) > threshold)) continue;
        rotated = true;
        rotate(work, p, q);
      }
    return rotated;
  }
  double max_on_diagonal(const mat3& work) {
    const double now = work.diagonal().max_abs();
    return largest_ = largest_ < now ? now : largest_;
  }
  void rotate(mat3& work, int p, int q) {
    double pp = work(p, p), pq = work(p, q), qp = work(q, p), qq = work(q, q);
    const double t = pp + qq, d = qp - pq;
    plane_rotation symmetrizing;
    if (!(std::abs(d) < 0x1p-1022)) {
      const double ratio = t / d, length = std::sqrt(1 + ratio * ratio);
      symmetrizing = {ratio / length, 1 / length};
    }
    symmetrizing.apply(pp, qp);
    symmetrizing.apply(pq, qq);
    const plane_rotation right = plane_rotation::diagonalizing(pp, pq, qq);
    const plane_rotation left = symmetrizing * right.transpose();
    for (vec3& column : work.columns) left.apply(column[p], column[q]);
    left.apply(u.columns[p], u.columns[q]);
    right.transpose().apply(work.columns[p], work.columns[q]);
    right.transpose().apply(v.columns[p], v.columns[q]);
  }

  double largest_ = 0;
};

/// Rotation R that maximises trace(R * covariance), by singular values (Sorkine-Hornung and Rabinovich 2017);
/// a covariance is the sum of source * target.transpose(), both less their means.
struct rotation_of_covariance {
  mat3 rotation;
  vec3 singular_values;  ///< descending

  explicit rotation_of_covariance(const mat3& covariance) {
    const svd_of_mat3 svd(covariance);
    singular_values = svd.values;
    mat3 v = svd.v;
    if ((v * svd.u.transpose()).determinant() < 0) v.columns[2] = -v.columns[2];
    for (int c = 0; c < 3; ++c)  // summed from the back, as Eigen does where it assigns to a part
      for (int r = 0; r < 3; ++r)
        rotation(r, c) = v(r, 0) * svd.u(c, 0) + (v(r, 1) * svd.u(c, 1) + v(r, 2) * svd.u(c, 2));
  }
};

}  // namespace globalmatch::detail
