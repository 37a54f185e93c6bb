// The instruction sets that this machine can run, and tiles and programs to run kernels on.
#pragma once

#include "kernels/find_kernels.h"
#include "kernels/isa_list.h"
#include "layout/merge_program.h"
#include "perf/judge/oracle/box_tile.h"

#include <cab/types.h>

#include <cstring>
#include <vector>

namespace cab::tests {

// Every table of kernels of this build that this CPU runs; scalar comes first.
inline std::vector<const kernel::KernelTable*> available_kernels() {
  std::vector<const kernel::KernelTable*> out;
  for (const Isa isa : kernel::kAllIsas)
    if (const kernel::KernelTable* table = kernel::find_kernels(isa)) out.push_back(table);
  return out;
}

inline const char* name_of(const kernel::KernelTable& table) { return kernel::isa_name(table.isa); }

using oracle::get;

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

// One merge of leaf 0 and leaf 1, with link 0's joint or without a joint.
inline MergeProgram pair_program(bool has_joint) {
  static constexpr MergeStep kAtJoint[] = {{0, 1, 0}};
  static constexpr MergeStep kFree[] = {{0, 1, kNoJoint}};
  static constexpr std::uint16_t kCounts[] = {1, 1, 2}, kFirst[] = {0, 1, 0}, kLeafSequence[] = {0, 1};
  return {{has_joint ? kAtJoint : kFree, 1}, {kCounts, 3}, {kFirst, 3}, {kLeafSequence, 2}, 1};
}

}  // namespace cab::tests
