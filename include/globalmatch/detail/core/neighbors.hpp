// Nearest neighbours: the one seam to nanoflann, through what its versions 1.4.3 to 1.12 share.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"

namespace globalmatch::detail {

/// Immutable k-d tree over its own copy of points with `Dimension` coordinates of type T. Built in O(n log
/// n); safe to query from several threads.
template <class T, int Dimension>
class neighbor_tree {
 public:
  using query_point = std::array<T, Dimension>;

  /// `at(i)` returns point i of `count` as anything with `[0] ... [Dimension - 1]`.
  template <class At>
  neighbor_tree(std::size_t count, const At& at) : data_(std::make_unique<dataset>()) {
    data_->points.resize(count);
    // Constant subscripts suit std::array and Eigen alike, whose index types differ in sign.
    [&]<std::size_t... d>(std::index_sequence<d...>) {
      for (std::size_t i = 0; i < count; ++i) {
        const auto p = at(i);
        data_->points[i] = {static_cast<T>(p[d])...};
      }
    }
    (std::make_index_sequence<std::size_t(Dimension)>());
    tree_ = std::make_unique<tree>(Dimension, *data_);
  }

  std::size_t size() const { return data_->points.size(); }
  const query_point& operator[](std::size_t i) const { return data_->points[i]; }

  /// Calls `visit(index, squared_distance)` for every point nearer than `radius`, in an order that depends on
  /// the points alone.
  template <class Visit>
  void for_each_within(const query_point& query, T radius, const Visit& visit) const {
    if (size() == 0) return;
    within<Visit> result{radius * radius, visit};
    tree_->findNeighbors(result, query.data(), {});
  }

  /// The `k` nearest points (fewer when there are fewer), ordered by (distance, index). `found` is reused
  /// memory.
  void nearest(const query_point& query, std::size_t k, std::vector<neighbor<T>>& found) const {
    found.clear();
    if (size() == 0 || k == 0) return;
    k_nearest result{std::min(k, size()), found};
    tree_->findNeighbors(result, query.data(), {});
  }

 private:
  struct dataset {
    std::vector<query_point> points;
    std::size_t kdtree_get_point_count() const { return points.size(); }
    T kdtree_get_pt(std::size_t i, std::size_t d) const { return points[i][d]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  using tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<T, dataset>, dataset, Dimension>;

  template <class Visit>
  struct within {
    using DistanceType = T;
    using IndexType = std::uint32_t;  // asked for from version 1.10 on
    T squared_radius;
    const Visit& visit;
    bool full() const { return true; }
    bool empty() const { return false; }
    std::size_t size() const { return 0; }
    T worstDist() const { return squared_radius; }
    void sort() const {}
    template <class Index>
    bool addPoint(T squared_distance, Index index) {
      visit(static_cast<std::uint32_t>(index), squared_distance);
      return true;
    }
  };

  struct k_nearest {
    using DistanceType = T;
    using IndexType = std::uint32_t;  // asked for from version 1.10 on
    std::size_t k;
    std::vector<neighbor<T>>& found;
    bool full() const { return found.size() == k; }
    bool empty() const { return found.empty(); }
    std::size_t size() const { return found.size(); }
    void sort() const {}
    // nanoflann looks at points strictly nearer than this: a little further, so that ties can go by index.
    T worstDist() const {
      using limits = std::numeric_limits<T>;
      if (!full()) return limits::max();
      return std::nextafter(found.back().squared_distance * (1 + 16 * limits::epsilon()), limits::max());
    }
    template <class Index>
    bool addPoint(T squared_distance, Index index) {
      const neighbor<T> candidate{static_cast<std::uint32_t>(index), squared_distance};
      if (full()) {
        if (!(candidate < found.back())) return true;
        found.pop_back();
      }
      found.insert(std::upper_bound(found.begin(), found.end(), candidate), candidate);
      return true;
    }
  };

  std::unique_ptr<dataset> data_;
  std::unique_ptr<tree> tree_;
};

}  // namespace globalmatch::detail
