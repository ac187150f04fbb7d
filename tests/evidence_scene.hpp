// Two stem maps and the evidence of their positions.
#pragma once

#include <memory>

#include "globalmatch/detail/matching/position_evidence.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::scenes {

/// Two maps, all that their evidence refers to, and the evidence.
struct evidence_scene {
  position_set source;
  prepared_stems target;
  matching_options options;
  matching_funnel funnel;
  matching_context maps;
  position_evidence positions_of;

  evidence_scene(const positions& from, const positions& to, const matching_options& chosen = {})
      : source(scenes::set_in_order(from)),
        target(prepare_stems(scenes::set_in_order(to), true, {})),
        options(chosen),
        maps(source, target.stems, std::make_shared<position_index>(source), target.index, false, four),
        positions_of(maps, target, options, funnel) {}
  evidence_scene(const evidence_scene&) = delete;
};

}  // namespace globalmatch::scenes
