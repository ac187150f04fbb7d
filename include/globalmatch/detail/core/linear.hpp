// The plain structs that the internals compute with: vec2, vec3, vec3f; mat2, mat3; rigid.
#pragma once

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/vectors.hpp"
