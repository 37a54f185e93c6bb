// The paper's five scenes by the number of their table.
#include "scenes/paper/registry.h"

#include "scenes/paper/braid.h"
#include "scenes/paper/chains.h"
#include "scenes/paper/hand.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace cab::scenes {

Scene make_paper_scene(std::uint32_t table, std::uint32_t frame_count) {
  const auto entry = std::find_if(kPaperScenes.begin(), kPaperScenes.end(),
                                  [table](const PaperScene& scene) { return scene.table == table; });
  if (entry == kPaperScenes.end())
    throw std::invalid_argument("make_paper_scene: the paper has tables 1 to 5, not " + std::to_string(table));
  const std::uint32_t frames = frame_count > 0 ? frame_count : entry->frame_count;
  if (table == 5) return make_hand(frames);
  return table == 4 ? make_braid(frames) : make_chains(table, frames);
}

}  // namespace cab::scenes
