// A Collada file on its way to assimp.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace cab::scenes {

// The text of a Collada file, but for what assimp 5.2.5 would read wrong:
// - No text and no attribute begins or ends with white space. XML Schema gives it no meaning (whiteSpace="collapse"),
//   but assimp refuses colours that begin with it, shifts the weights of a skin by one, and passes over an `up_axis`.
// - The joints of a skin, which the file names by their sid, are those below the skin's own skeletons, named by their
//   id. assimp takes the first node with that sid in the whole file, so that two figures would become one.
// - Nodes without an id have their sid for one; it is unique.
// Nothing if the text is no XML that tinyxml2 reads, or is nested too deep for it: assimp reads it as it is, or says
// what is wrong with it. `notes` gets that, and what is still not told apart.
std::optional<std::string> collada_for_assimp(const std::string& text, std::vector<std::string>& notes);

}  // namespace cab::scenes
