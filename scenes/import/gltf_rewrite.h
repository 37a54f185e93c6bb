// A glTF file of version 2, written anew with what import reads of it, in the forms that assimp 5.2.5 reads right.
#pragma once

#include <string>
#include <vector>

namespace cab::scenes {

class GltfDocument;

// A GLB of the nodes, meshes, skins and animations of the scene of a checked file. It differs from the file:
// - Positions, weights and keys are floats without gaps: integers of 8 or 16 bits are normalized as the specification
//   says, sparse values are in their places, and an accessor without a view is 0. Joint numbers have 16 bits.
// - Names of nodes are unique, since assimp tells bones and tracks apart by name. Joints, animated nodes and bones keep
//   theirs before others do; the second of a name N becomes "N (2)". A node without a name is "nodes[INDEX]".
// - Several roots of the scene get one root above them, as assimp would make it.
// - A skin without inverse bind matrices has the identity. A mesh that several skins move is there once for each.
// - Materials, images, morph targets, extensions and what is not in the scene are left out. Of cameras and lights only
//   which nodes have one is left. Of cubic splines the keys are left, without tangents.
// `notes` gets what the user may not expect, `bones` the new names of the nodes of vrm_bones (vrm_bones.h). Throws
// ImportError if a mesh or an array is not as the specification says, or if the arrays take more than kMaxFileBytes.
std::string rewrite_gltf(const GltfDocument& file, std::vector<std::string>& notes, std::vector<std::string>& bones);

}  // namespace cab::scenes
