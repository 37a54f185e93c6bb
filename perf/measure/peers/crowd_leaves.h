// The leaves of a crowd, numbered through: group by group, character by character, leaf by leaf of the figure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scenes/crowd/crowd.h"

namespace cab::perf {

class CrowdLeaves {
 public:
  // A character of the crowd. Characters are numbered through, too.
  struct Character {
    std::uint32_t group;
    std::uint32_t instance;    // in its group
    std::uint32_t first_leaf;  // its leaves follow each other
  };

  explicit CrowdLeaves(const scenes::Crowd& crowd) {
    std::uint32_t first_kind = 0;
    for (const scenes::CrowdGroup& group : crowd.groups) {
      const auto group_number = static_cast<std::uint32_t>(first_characters_.size());
      const auto leaves = static_cast<std::uint32_t>(group.figure.leaves.size());
      first_characters_.push_back(character_count());
      for (std::uint32_t instance = 0; instance < group.count; ++instance) {
        const std::uint32_t character = character_count();
        characters_.push_back({group_number, instance, leaf_count()});
        for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) places_.push_back({character, first_kind + leaf});
      }
      first_kind += leaves;
    }
  }

  std::uint32_t character_count() const { return static_cast<std::uint32_t>(characters_.size()); }
  std::uint32_t leaf_count() const { return static_cast<std::uint32_t>(places_.size()); }
  const Character& character(std::uint32_t number) const { return characters_[number]; }
  std::uint32_t character_of(std::uint32_t leaf) const { return places_[leaf].character; }

  // Which leaf of which figure a leaf is: the leaves of all groups' figures are numbered through.
  std::uint32_t kind_of(std::uint32_t leaf) const { return places_[leaf].kind; }

  // The leaf before which the leaves of a character end.
  std::uint32_t end_leaf(std::uint32_t character) const {
    return character + 1 < character_count() ? characters_[character + 1].first_leaf : leaf_count();
  }

  // The number of a leaf of an instance of a group.
  std::uint32_t number_of(std::uint32_t group, std::uint32_t instance, std::uint32_t leaf) const {
    return characters_[first_characters_[group] + instance].first_leaf + leaf;
  }

 private:
  struct Place {
    std::uint32_t character;
    std::uint32_t kind;
  };
  std::vector<std::uint32_t> first_characters_;  // of each group
  std::vector<Character> characters_;
  std::vector<Place> places_;  // of each leaf
};

}  // namespace cab::perf
