// The compiled mode: with GLOBALMATCH_COMPILED defined (target `globalmatch::compiled`) the headers declare
// the few functions in which nearly all code is, and a library defines them. Without it they are inline.
#pragma once

#include <Eigen/Core>

#if defined(GLOBALMATCH_COMPILED)
#define GLOBALMATCH_INLINE
#else
#define GLOBALMATCH_INLINE inline
#endif

namespace globalmatch::detail {

/// Last argument of the functions that are compiled once, so that their names differ where their code does: a
/// library compiled for other processors than its user, where Eigen aligns results otherwise, does not link.
/// A program uses one mode.
template <int EigenAlignment, bool Compiled>
struct mode {};

#if defined(GLOBALMATCH_COMPILED)
using build_mode = mode<EIGEN_MAX_STATIC_ALIGN_BYTES, true>;
#else
using build_mode = mode<EIGEN_MAX_STATIC_ALIGN_BYTES, false>;
#endif

}  // namespace globalmatch::detail
