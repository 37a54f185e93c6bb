// Why an instance is masked, in words.
#pragma once

#include <cab/types.h>

#include <string>
#include <vector>

namespace cab::perf {

// Which link it is about and what is wrong, such as "link 3 (head): its scale is 0; the limit is 0.001".
std::string words_of(const MaskReason& reason, const std::vector<std::string>& link_names);

}  // namespace cab::perf
