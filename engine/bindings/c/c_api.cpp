// The C API: every call hands its arguments to the C++ call. Made by engine/bindings/make_c_api: do not edit.
#include <cab/cab.h>
#include <cab/cab_c.h>

#include <cstddef>
#include <cstring>

namespace cab {
namespace {

// What a pointer of the C API points to. The bytes are the same, as is asserted below.
template <class To, class From>
To* at(From* from) noexcept {
  return reinterpret_cast<To*>(from);
}

// A value of the C API as one of the C++ API, or the other way round.
template <class To, class From>
To as(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(static_cast<void*>(&to), &from, sizeof(To));
  return to;
}

#define CAB_SAME_TYPE(type) static_assert(sizeof(type) == sizeof(cab_##type) && alignof(type) == alignof(cab_##type))
#define CAB_SAME_MEMBER(type, member)                                     \
  static_assert(offsetof(type, member) == offsetof(cab_##type, member) && \
                sizeof(type::member) == sizeof(cab_##type::member))
#define CAB_SAME_VALUE(value, twin) static_assert(static_cast<long long>(value) == (twin))
#define CAB_SAME_SPAN(twin) \
  static_assert(sizeof(twin) == sizeof(Span<char>) && offsetof(twin, size) == offsetof(Span<char>, size))

CAB_SAME_TYPE(Status);
CAB_SAME_VALUE(Status::kOk, CAB_STATUS_OK);
CAB_SAME_VALUE(Status::kOutOfMemory, CAB_STATUS_OUT_OF_MEMORY);
CAB_SAME_VALUE(Status::kBusy, CAB_STATUS_BUSY);
CAB_SAME_VALUE(Status::kIsaNotAvailable, CAB_STATUS_ISA_NOT_AVAILABLE);
CAB_SAME_VALUE(Status::kBadAbiVersion, CAB_STATUS_BAD_ABI_VERSION);
CAB_SAME_VALUE(Status::kBadScheduler, CAB_STATUS_BAD_SCHEDULER);
CAB_SAME_VALUE(Status::kBadAllocator, CAB_STATUS_BAD_ALLOCATOR);
CAB_SAME_VALUE(Status::kBadProfiler, CAB_STATUS_BAD_PROFILER);
CAB_SAME_VALUE(Status::kNoLinks, CAB_STATUS_NO_LINKS);
CAB_SAME_VALUE(Status::kTooManyLinks, CAB_STATUS_TOO_MANY_LINKS);
CAB_SAME_VALUE(Status::kNoLeaves, CAB_STATUS_NO_LEAVES);
CAB_SAME_VALUE(Status::kTooManyLeaves, CAB_STATUS_TOO_MANY_LEAVES);
CAB_SAME_VALUE(Status::kBadParent, CAB_STATUS_BAD_PARENT);
CAB_SAME_VALUE(Status::kBadJoint, CAB_STATUS_BAD_JOINT);
CAB_SAME_VALUE(Status::kBadLeafLink, CAB_STATUS_BAD_LEAF_LINK);
CAB_SAME_VALUE(Status::kBadLeafBox, CAB_STATUS_BAD_LEAF_BOX);
CAB_SAME_VALUE(Status::kBadLeafAxes, CAB_STATUS_BAD_LEAF_AXES);
CAB_SAME_VALUE(Status::kBadShape, CAB_STATUS_BAD_SHAPE);
CAB_SAME_VALUE(Status::kShapeOutsideLeafBox, CAB_STATUS_SHAPE_OUTSIDE_LEAF_BOX);
CAB_SAME_VALUE(Status::kBadVertices, CAB_STATUS_BAD_VERTICES);
CAB_SAME_VALUE(Status::kBadIgnoredPair, CAB_STATUS_BAD_IGNORED_PAIR);
CAB_SAME_VALUE(Status::kBadRestPose, CAB_STATUS_BAD_REST_POSE);
CAB_SAME_VALUE(Status::kUnknownArticulation, CAB_STATUS_UNKNOWN_ARTICULATION);
CAB_SAME_VALUE(Status::kUnknownBatch, CAB_STATUS_UNKNOWN_BATCH);
CAB_SAME_VALUE(Status::kArticulationInUse, CAB_STATUS_ARTICULATION_IN_USE);
CAB_SAME_VALUE(Status::kBadLod, CAB_STATUS_BAD_LOD);
CAB_SAME_VALUE(Status::kTooFewLeaves, CAB_STATUS_TOO_FEW_LEAVES);
CAB_SAME_VALUE(Status::kLodLeafTooSmall, CAB_STATUS_LOD_LEAF_TOO_SMALL);
CAB_SAME_VALUE(Status::kBadBatchKind, CAB_STATUS_BAD_BATCH_KIND);
CAB_SAME_VALUE(Status::kNoInstances, CAB_STATUS_NO_INSTANCES);
CAB_SAME_VALUE(Status::kBadStaticBody, CAB_STATUS_BAD_STATIC_BODY);
CAB_SAME_VALUE(Status::kBadTriangles, CAB_STATUS_BAD_TRIANGLES);
CAB_SAME_VALUE(Status::kTooManyInstances, CAB_STATUS_TOO_MANY_INSTANCES);
CAB_SAME_VALUE(Status::kBatchGivenTwice, CAB_STATUS_BATCH_GIVEN_TWICE);
CAB_SAME_VALUE(Status::kBadPoses, CAB_STATUS_BAD_POSES);
CAB_SAME_VALUE(Status::kBadStates, CAB_STATUS_BAD_STATES);
CAB_SAME_VALUE(Status::kStaticInput, CAB_STATUS_STATIC_INPUT);
CAB_SAME_VALUE(Status::kBadOrigins, CAB_STATUS_BAD_ORIGINS);
CAB_SAME_VALUE(Status::kBadOrientations, CAB_STATUS_BAD_ORIENTATIONS);
CAB_SAME_VALUE(Status::kBadFlags, CAB_STATUS_BAD_FLAGS);
CAB_SAME_VALUE(Status::kBadLayers, CAB_STATUS_BAD_LAYERS);
CAB_SAME_VALUE(Status::kBadInContact, CAB_STATUS_BAD_IN_CONTACT);
CAB_SAME_VALUE(Status::kBadScales, CAB_STATUS_BAD_SCALES);
CAB_SAME_VALUE(Status::kBadCount, CAB_STATUS_BAD_COUNT);
CAB_SAME_VALUE(Status::kBadInstances, CAB_STATUS_BAD_INSTANCES);
CAB_SAME_VALUE(Status::kBadBounds, CAB_STATUS_BAD_BOUNDS);
CAB_SAME_VALUE(Status::kBadMoved, CAB_STATUS_BAD_MOVED);
CAB_SAME_VALUE(Status::kBadMargins, CAB_STATUS_BAD_MARGINS);
CAB_SAME_VALUE(Status::kMovedAtRest, CAB_STATUS_MOVED_AT_REST);
CAB_SAME_VALUE(Status::kBadPairRule, CAB_STATUS_BAD_PAIR_RULE);
CAB_SAME_VALUE(Status::kPairRuleGivenTwice, CAB_STATUS_PAIR_RULE_GIVEN_TWICE);
CAB_SAME_VALUE(Status::kBadPolicy, CAB_STATUS_BAD_POLICY);
CAB_SAME_VALUE(Status::kExactNotBuilt, CAB_STATUS_EXACT_NOT_BUILT);
CAB_SAME_VALUE(Status::kBadReport, CAB_STATUS_BAD_REPORT);
CAB_SAME_VALUE(Status::kBadMargin, CAB_STATUS_BAD_MARGIN);
CAB_SAME_VALUE(Status::kBadMinDepth, CAB_STATUS_BAD_MIN_DEPTH);
CAB_SAME_VALUE(Status::kBadHitBuffer, CAB_STATUS_BAD_HIT_BUFFER);
CAB_SAME_VALUE(Status::kContactsNeedExact, CAB_STATUS_CONTACTS_NEED_EXACT);
CAB_SAME_VALUE(Status::kLodWithoutShapes, CAB_STATUS_LOD_WITHOUT_SHAPES);
CAB_SAME_VALUE(Status::kBadInstance, CAB_STATUS_BAD_INSTANCE);
CAB_SAME_VALUE(Status::kBadPairs, CAB_STATUS_BAD_PAIRS);
CAB_SAME_VALUE(Status::kBadResolution, CAB_STATUS_BAD_RESOLUTION);
CAB_SAME_VALUE(Status::kBadOutput, CAB_STATUS_BAD_OUTPUT);
CAB_SAME_VALUE(Status::kNullArgument, CAB_STATUS_NULL_ARGUMENT);
CAB_SAME_VALUE(Status::kHitsOverflow, CAB_STATUS_HITS_OVERFLOW);
CAB_SAME_VALUE(Status::kPairsOverflow, CAB_STATUS_PAIRS_OVERFLOW);
CAB_SAME_VALUE(Status::kLinesOverflow, CAB_STATUS_LINES_OVERFLOW);
CAB_SAME_VALUE(Status::kNoFrame, CAB_STATUS_NO_FRAME);
CAB_SAME_VALUE(Status::kBadTask, CAB_STATUS_BAD_TASK);
CAB_SAME_VALUE(Status::kTasksLeft, CAB_STATUS_TASKS_LEFT);
CAB_SAME_VALUE(Status::kUnsortedHits, CAB_STATUS_UNSORTED_HITS);
CAB_SAME_VALUE(Status::kBadQuery, CAB_STATUS_BAD_QUERY);
CAB_SAME_VALUE(Status::kNoQueryMemory, CAB_STATUS_NO_QUERY_MEMORY);
CAB_SAME_VALUE(Status::kBadTicks, CAB_STATUS_BAD_TICKS);
CAB_SAME_VALUE(Status::kUnknownHistory, CAB_STATUS_UNKNOWN_HISTORY);
CAB_SAME_VALUE(Status::kHistoryGivenTwice, CAB_STATUS_HISTORY_GIVEN_TWICE);
CAB_SAME_VALUE(Status::kBadTime, CAB_STATUS_BAD_TIME);
CAB_SAME_VALUE(Status::kBadHistoryPoses, CAB_STATUS_BAD_HISTORY_POSES);
CAB_SAME_VALUE(Status::kBadSkin, CAB_STATUS_BAD_SKIN);
CAB_SAME_VALUE(Status::kBadLeafTriangles, CAB_STATUS_BAD_LEAF_TRIANGLES);
CAB_SAME_VALUE(Status::kTooManyInfluences, CAB_STATUS_TOO_MANY_INFLUENCES);
CAB_SAME_VALUE(Status::kSkinNotTaken, CAB_STATUS_SKIN_NOT_TAKEN);
CAB_SAME_TYPE(Isa);
CAB_SAME_VALUE(Isa::kAuto, CAB_ISA_AUTO);
CAB_SAME_VALUE(Isa::kScalar, CAB_ISA_SCALAR);
CAB_SAME_VALUE(Isa::kSse2, CAB_ISA_SSE2);
CAB_SAME_VALUE(Isa::kAvx2, CAB_ISA_AVX2);
CAB_SAME_VALUE(Isa::kAvx512, CAB_ISA_AVX512);
CAB_SAME_VALUE(Isa::kNeon64, CAB_ISA_NEON64);
CAB_SAME_VALUE(Isa::kWasm128, CAB_ISA_WASM128);
CAB_SAME_TYPE(PoseFormat);
CAB_SAME_VALUE(PoseFormat::kQuaternionTranslation, CAB_POSE_FORMAT_QUATERNION_TRANSLATION);
CAB_SAME_VALUE(PoseFormat::kMatrix3x4Rows, CAB_POSE_FORMAT_MATRIX3X4_ROWS);
CAB_SAME_VALUE(PoseFormat::kMatrix4x4Columns, CAB_POSE_FORMAT_MATRIX4X4_COLUMNS);
CAB_SAME_TYPE(ShapeKind);
CAB_SAME_VALUE(ShapeKind::kBox, CAB_SHAPE_KIND_BOX);
CAB_SAME_VALUE(ShapeKind::kEllipsoid, CAB_SHAPE_KIND_ELLIPSOID);
CAB_SAME_VALUE(ShapeKind::kCapsule, CAB_SHAPE_KIND_CAPSULE);
CAB_SAME_VALUE(ShapeKind::kConvexHull, CAB_SHAPE_KIND_CONVEX_HULL);
CAB_SAME_VALUE(ShapeKind::kSphere, CAB_SHAPE_KIND_SPHERE);
CAB_SAME_VALUE(ShapeKind::kCylinder, CAB_SHAPE_KIND_CYLINDER);
CAB_SAME_VALUE(ShapeKind::kHalfSpace, CAB_SHAPE_KIND_HALF_SPACE);
CAB_SAME_TYPE(LodKind);
CAB_SAME_VALUE(LodKind::kReach, CAB_LOD_KIND_REACH);
CAB_SAME_VALUE(LodKind::kNodes, CAB_LOD_KIND_NODES);
CAB_SAME_TYPE(IgnoredReason);
CAB_SAME_VALUE(kIgnoredExplicitly, CAB_IGNORED_EXPLICITLY);
CAB_SAME_VALUE(kIgnoredByHops, CAB_IGNORED_BY_HOPS);
CAB_SAME_VALUE(kIgnoredAtRest, CAB_IGNORED_AT_REST);
CAB_SAME_TYPE(BatchKind);
CAB_SAME_VALUE(BatchKind::kCharacters, CAB_BATCH_KIND_CHARACTERS);
CAB_SAME_VALUE(BatchKind::kSequence, CAB_BATCH_KIND_SEQUENCE);
CAB_SAME_TYPE(InstanceFlag);
CAB_SAME_VALUE(kInstanceOk, CAB_INSTANCE_OK);
CAB_SAME_VALUE(kInstanceNotFinite, CAB_INSTANCE_NOT_FINITE);
CAB_SAME_VALUE(kInstanceNotRigid, CAB_INSTANCE_NOT_RIGID);
CAB_SAME_TYPE(MaskCause);
CAB_SAME_VALUE(MaskCause::kNone, CAB_MASK_CAUSE_NONE);
CAB_SAME_VALUE(MaskCause::kPoseNumber, CAB_MASK_CAUSE_POSE_NUMBER);
CAB_SAME_VALUE(MaskCause::kOrientationNumber, CAB_MASK_CAUSE_ORIENTATION_NUMBER);
CAB_SAME_VALUE(MaskCause::kQuaternionLength, CAB_MASK_CAUSE_QUATERNION_LENGTH);
CAB_SAME_VALUE(MaskCause::kOrientationLength, CAB_MASK_CAUSE_ORIENTATION_LENGTH);
CAB_SAME_VALUE(MaskCause::kMatrix, CAB_MASK_CAUSE_MATRIX);
CAB_SAME_VALUE(MaskCause::kScale, CAB_MASK_CAUSE_SCALE);
CAB_SAME_VALUE(MaskCause::kJoint, CAB_MASK_CAUSE_JOINT);
CAB_SAME_VALUE(MaskCause::kBox, CAB_MASK_CAUSE_BOX);
CAB_SAME_TYPE(Resting);
CAB_SAME_VALUE(Resting::kReported, CAB_RESTING_REPORTED);
CAB_SAME_VALUE(Resting::kSkipped, CAB_RESTING_SKIPPED);
CAB_SAME_TYPE(Pairing);
CAB_SAME_VALUE(Pairing::kBetween, CAB_PAIRING_BETWEEN);
CAB_SAME_VALUE(Pairing::kWithin, CAB_PAIRING_WITHIN);
CAB_SAME_TYPE(Report);
CAB_SAME_VALUE(Report::kHits, CAB_REPORT_HITS);
CAB_SAME_VALUE(Report::kInContact, CAB_REPORT_IN_CONTACT);
CAB_SAME_VALUE(Report::kDistances, CAB_REPORT_DISTANCES);
CAB_SAME_TYPE(JointKind);
CAB_SAME_VALUE(JointKind::kRevolute, CAB_JOINT_KIND_REVOLUTE);
CAB_SAME_VALUE(JointKind::kPrismatic, CAB_JOINT_KIND_PRISMATIC);
CAB_SAME_VALUE(JointKind::kBall, CAB_JOINT_KIND_BALL);
CAB_SAME_TYPE(QueryKind);
CAB_SAME_VALUE(QueryKind::kRay, CAB_QUERY_KIND_RAY);
CAB_SAME_VALUE(QueryKind::kSphere, CAB_QUERY_KIND_SPHERE);
CAB_SAME_VALUE(QueryKind::kBox, CAB_QUERY_KIND_BOX);
CAB_SAME_VALUE(QueryKind::kCapsule, CAB_QUERY_KIND_CAPSULE);
CAB_SAME_VALUE(QueryKind::kPoint, CAB_QUERY_KIND_POINT);
CAB_SAME_VALUE(QueryKind::kRegion, CAB_QUERY_KIND_REGION);
CAB_SAME_TYPE(QueryWant);
CAB_SAME_VALUE(QueryWant::kAny, CAB_QUERY_WANT_ANY);
CAB_SAME_VALUE(QueryWant::kClosest, CAB_QUERY_WANT_CLOSEST);
CAB_SAME_VALUE(QueryWant::kAll, CAB_QUERY_WANT_ALL);
CAB_SAME_TYPE(Refit);
CAB_SAME_VALUE(Refit::kCab, CAB_REFIT_CAB);
CAB_SAME_VALUE(Refit::kBest3, CAB_REFIT_BEST3);
CAB_SAME_VALUE(Refit::kCabSum, CAB_REFIT_CAB_SUM);
CAB_SAME_VALUE(Refit::kCovariance, CAB_REFIT_COVARIANCE);
CAB_SAME_VALUE(Refit::kAabbHull, CAB_REFIT_AABB_HULL);
CAB_SAME_VALUE(Refit::kAabbVertices, CAB_REFIT_AABB_VERTICES);
CAB_SAME_TYPE(Extents);
CAB_SAME_VALUE(Extents::kChildren, CAB_EXTENTS_CHILDREN);
CAB_SAME_VALUE(Extents::kLeaves, CAB_EXTENTS_LEAVES);
CAB_SAME_TYPE(Strategy);
CAB_SAME_VALUE(Strategy::kTree, CAB_STRATEGY_TREE);
CAB_SAME_VALUE(Strategy::kRows, CAB_STRATEGY_ROWS);
CAB_SAME_VALUE(Strategy::kLinks, CAB_STRATEGY_LINKS);
CAB_SAME_VALUE(Strategy::kBrute, CAB_STRATEGY_BRUTE);
CAB_SAME_VALUE(Strategy::kAuto, CAB_STRATEGY_AUTO);
CAB_SAME_TYPE(Exact);
CAB_SAME_VALUE(Exact::kNone, CAB_EXACT_NONE);
CAB_SAME_VALUE(Exact::kFcl, CAB_EXACT_FCL);
CAB_SAME_VALUE(Exact::kConvex, CAB_EXACT_CONVEX);
CAB_SAME_VALUE(Exact::kSurface, CAB_EXACT_SURFACE);
CAB_SAME_TYPE(Sat);
CAB_SAME_VALUE(Sat::kAll15, CAB_SAT_ALL15);
CAB_SAME_VALUE(Sat::kFaces6, CAB_SAT_FACES6);
static_assert(kMaxLinks == CAB_MAX_LINKS);
static_assert(kMaxLeaves == CAB_MAX_LEAVES);
static_assert(kMaxInstances == CAB_MAX_INSTANCES);
static_assert(kMaxBatches == CAB_MAX_BATCHES);
static_assert(kMaxWorkers == CAB_MAX_WORKERS);
static_assert(kMaxCoordinate == CAB_MAX_COORDINATE);
static_assert(kMinScale == CAB_MIN_SCALE);
static_assert(kMaxScale == CAB_MAX_SCALE);
static_assert(kIsaCount == CAB_ISA_COUNT);
static_assert(kNoLeaf == CAB_NO_LEAF);
static_assert(kNoJoint == CAB_NO_JOINT);
static_assert(kAllInstances == CAB_ALL_INSTANCES);
static_assert(kNeverTouch == CAB_NEVER_TOUCH);
static_assert(kMaxTicks == CAB_MAX_TICKS);
static_assert(kNow == CAB_NOW);
static_assert(kQueryKindCount == CAB_QUERY_KIND_COUNT);
static_assert(kQueryWantCount == CAB_QUERY_WANT_COUNT);
static_assert(kMaxQueryCoordinate == CAB_MAX_QUERY_COORDINATE);
static_assert(kRefitCount == CAB_REFIT_COUNT);
static_assert(kExtentsCount == CAB_EXTENTS_COUNT);
static_assert(kStrategyCount == CAB_STRATEGY_COUNT);
static_assert(kExactCount == CAB_EXACT_COUNT);
static_assert(kSatCount == CAB_SAT_COUNT);
static_assert(kLeafLevel == CAB_LEAF_LEVEL);
static_assert(kNoLink == CAB_NO_LINK);
CAB_SAME_TYPE(ArticulationId);
CAB_SAME_MEMBER(ArticulationId, value);
CAB_SAME_TYPE(BatchId);
CAB_SAME_MEMBER(BatchId, value);
CAB_SAME_TYPE(BatchSlot);
CAB_SAME_MEMBER(BatchSlot, value);
CAB_SAME_TYPE(Box);
CAB_SAME_MEMBER(Box, center);
CAB_SAME_MEMBER(Box, axis);
CAB_SAME_MEMBER(Box, half);
CAB_SAME_TYPE(PoseView);
CAB_SAME_MEMBER(PoseView, format);
CAB_SAME_MEMBER(PoseView, data);
CAB_SAME_MEMBER(PoseView, link_stride);
CAB_SAME_MEMBER(PoseView, instance_stride);
CAB_SAME_MEMBER(PoseView, has_scale);
CAB_SAME_TYPE(StateView);
CAB_SAME_MEMBER(StateView, kinematics);
CAB_SAME_MEMBER(StateView, values);
CAB_SAME_MEMBER(StateView, poses);
CAB_SAME_TYPE(ConvexPart);
CAB_SAME_MEMBER(ConvexPart, kind);
CAB_SAME_MEMBER(ConvexPart, position);
CAB_SAME_MEMBER(ConvexPart, rotation);
CAB_SAME_MEMBER(ConvexPart, size);
CAB_SAME_MEMBER(ConvexPart, vertices);
CAB_SAME_TYPE(Leaf);
CAB_SAME_MEMBER(Leaf, link);
CAB_SAME_MEMBER(Leaf, box);
CAB_SAME_MEMBER(Leaf, parts);
CAB_SAME_MEMBER(Leaf, triangles);
CAB_SAME_TYPE(SkinDesc);
CAB_SAME_MEMBER(SkinDesc, vertices);
CAB_SAME_MEMBER(SkinDesc, influence_count);
CAB_SAME_MEMBER(SkinDesc, influence_links);
CAB_SAME_MEMBER(SkinDesc, influence_weights);
CAB_SAME_MEMBER(SkinDesc, inverse_bind);
CAB_SAME_TYPE(LinkPair);
CAB_SAME_MEMBER(LinkPair, a);
CAB_SAME_MEMBER(LinkPair, b);
CAB_SAME_TYPE(ArticulationDesc);
CAB_SAME_MEMBER(ArticulationDesc, link_parents);
CAB_SAME_MEMBER(ArticulationDesc, link_joints);
CAB_SAME_MEMBER(ArticulationDesc, leaves);
CAB_SAME_MEMBER(ArticulationDesc, ignored_pairs);
CAB_SAME_MEMBER(ArticulationDesc, ignored_hops);
CAB_SAME_MEMBER(ArticulationDesc, rest_pose);
CAB_SAME_MEMBER(ArticulationDesc, skin);
CAB_SAME_TYPE(LodLeaf);
CAB_SAME_MEMBER(LodLeaf, link);
CAB_SAME_MEMBER(LodLeaf, box);
CAB_SAME_MEMBER(LodLeaf, links);
CAB_SAME_TYPE(LodDesc);
CAB_SAME_MEMBER(LodDesc, of);
CAB_SAME_MEMBER(LodDesc, kind);
CAB_SAME_MEMBER(LodDesc, max_leaves);
CAB_SAME_MEMBER(LodDesc, leaves);
CAB_SAME_MEMBER(LodDesc, rest_poses);
CAB_SAME_MEMBER(LodDesc, rest_pose_count);
CAB_SAME_MEMBER(LodDesc, joint_play);
CAB_SAME_TYPE(IgnoredPair);
CAB_SAME_MEMBER(IgnoredPair, a);
CAB_SAME_MEMBER(IgnoredPair, b);
CAB_SAME_MEMBER(IgnoredPair, reasons);
CAB_SAME_TYPE(MergeStep);
CAB_SAME_MEMBER(MergeStep, left);
CAB_SAME_MEMBER(MergeStep, right);
CAB_SAME_MEMBER(MergeStep, joint_link);
CAB_SAME_TYPE(ArticulationInfo);
CAB_SAME_MEMBER(ArticulationInfo, link_count);
CAB_SAME_MEMBER(ArticulationInfo, leaf_count);
CAB_SAME_MEMBER(ArticulationInfo, node_count);
CAB_SAME_MEMBER(ArticulationInfo, depth);
CAB_SAME_MEMBER(ArticulationInfo, ignored_pair_count);
CAB_SAME_TYPE(BatchDesc);
CAB_SAME_MEMBER(BatchDesc, articulation);
CAB_SAME_MEMBER(BatchDesc, instance_count);
CAB_SAME_MEMBER(BatchDesc, kind);
CAB_SAME_TYPE(StaticBody);
CAB_SAME_MEMBER(StaticBody, origin);
CAB_SAME_MEMBER(StaticBody, rotation);
CAB_SAME_MEMBER(StaticBody, box);
CAB_SAME_MEMBER(StaticBody, parts);
CAB_SAME_TYPE(StaticDesc);
CAB_SAME_MEMBER(StaticDesc, bodies);
CAB_SAME_MEMBER(StaticDesc, vertices);
CAB_SAME_MEMBER(StaticDesc, triangles);
CAB_SAME_MEMBER(StaticDesc, origin);
CAB_SAME_TYPE(BatchInfo);
CAB_SAME_MEMBER(BatchInfo, articulation);
CAB_SAME_MEMBER(BatchInfo, instance_count);
CAB_SAME_MEMBER(BatchInfo, kind);
CAB_SAME_MEMBER(BatchInfo, is_static);
CAB_SAME_TYPE(ReserveDesc);
CAB_SAME_MEMBER(ReserveDesc, batches);
CAB_SAME_MEMBER(ReserveDesc, characters);
CAB_SAME_MEMBER(ReserveDesc, queries);
CAB_SAME_MEMBER(ReserveDesc, hits);
CAB_SAME_TYPE(EngineMemory);
CAB_SAME_MEMBER(EngineMemory, articulations);
CAB_SAME_MEMBER(EngineMemory, batches);
CAB_SAME_MEMBER(EngineMemory, workers);
CAB_SAME_MEMBER(EngineMemory, broad_phase);
CAB_SAME_MEMBER(EngineMemory, hits);
CAB_SAME_MEMBER(EngineMemory, queries);
CAB_SAME_MEMBER(EngineMemory, histories);
CAB_SAME_MEMBER(EngineMemory, total);
CAB_SAME_TYPE(MaskReason);
CAB_SAME_MEMBER(MaskReason, flag);
CAB_SAME_MEMBER(MaskReason, cause);
CAB_SAME_MEMBER(MaskReason, link);
CAB_SAME_MEMBER(MaskReason, index);
CAB_SAME_MEMBER(MaskReason, value);
CAB_SAME_MEMBER(MaskReason, limit);
CAB_SAME_TYPE(BatchInput);
CAB_SAME_MEMBER(BatchInput, batch);
CAB_SAME_MEMBER(BatchInput, poses);
CAB_SAME_MEMBER(BatchInput, origins);
CAB_SAME_MEMBER(BatchInput, orientations);
CAB_SAME_MEMBER(BatchInput, flags);
CAB_SAME_MEMBER(BatchInput, layers);
CAB_SAME_MEMBER(BatchInput, layer_masks);
CAB_SAME_MEMBER(BatchInput, in_contact);
CAB_SAME_MEMBER(BatchInput, scales);
CAB_SAME_MEMBER(BatchInput, count);
CAB_SAME_MEMBER(BatchInput, instances);
CAB_SAME_MEMBER(BatchInput, bounds);
CAB_SAME_MEMBER(BatchInput, margins);
CAB_SAME_MEMBER(BatchInput, moved);
CAB_SAME_MEMBER(BatchInput, states);
CAB_SAME_TYPE(PairRule);
CAB_SAME_MEMBER(PairRule, a);
CAB_SAME_MEMBER(PairRule, b);
CAB_SAME_MEMBER(PairRule, pairing);
CAB_SAME_MEMBER(PairRule, resting);
CAB_SAME_TYPE(Hit);
CAB_SAME_MEMBER(Hit, batch_a);
CAB_SAME_MEMBER(Hit, instance_a);
CAB_SAME_MEMBER(Hit, batch_b);
CAB_SAME_MEMBER(Hit, instance_b);
CAB_SAME_MEMBER(Hit, link_a);
CAB_SAME_MEMBER(Hit, link_b);
CAB_SAME_MEMBER(Hit, leaf_a);
CAB_SAME_MEMBER(Hit, leaf_b);
CAB_SAME_TYPE(InstancePair);
CAB_SAME_MEMBER(InstancePair, batch_a);
CAB_SAME_MEMBER(InstancePair, instance_a);
CAB_SAME_MEMBER(InstancePair, batch_b);
CAB_SAME_MEMBER(InstancePair, instance_b);
CAB_SAME_TYPE(CandidateList);
CAB_SAME_MEMBER(CandidateList, pairs);
CAB_SAME_MEMBER(CandidateList, pair_count);
CAB_SAME_MEMBER(CandidateList, pairs_needed);
CAB_SAME_TYPE(HitChanges);
CAB_SAME_MEMBER(HitChanges, began);
CAB_SAME_MEMBER(HitChanges, ended);
CAB_SAME_MEMBER(HitChanges, began_count);
CAB_SAME_MEMBER(HitChanges, ended_count);
CAB_SAME_TYPE(Contact);
CAB_SAME_MEMBER(Contact, normal);
CAB_SAME_MEMBER(Contact, depth);
CAB_SAME_MEMBER(Contact, point_a);
CAB_SAME_MEMBER(Contact, point_b);
CAB_SAME_MEMBER(Contact, leaf_a);
CAB_SAME_MEMBER(Contact, leaf_b);
CAB_SAME_TYPE(TouchingTriangles);
CAB_SAME_MEMBER(TouchingTriangles, pair);
CAB_SAME_MEMBER(TouchingTriangles, leaf_a);
CAB_SAME_MEMBER(TouchingTriangles, leaf_b);
CAB_SAME_MEMBER(TouchingTriangles, triangle_a);
CAB_SAME_MEMBER(TouchingTriangles, triangle_b);
CAB_SAME_TYPE(FrameStats);
CAB_SAME_MEMBER(FrameStats, candidates);
CAB_SAME_MEMBER(FrameStats, box_tests);
CAB_SAME_MEMBER(FrameStats, leaf_pairs);
CAB_SAME_MEMBER(FrameStats, exact_tests);
CAB_SAME_MEMBER(FrameStats, false_positives);
CAB_SAME_MEMBER(FrameStats, instances_masked);
CAB_SAME_MEMBER(FrameStats, instances_beyond_bounds);
CAB_SAME_MEMBER(FrameStats, instances_resting);
CAB_SAME_MEMBER(FrameStats, hits_kept);
CAB_SAME_MEMBER(FrameStats, leaves_skinned);
CAB_SAME_MEMBER(FrameStats, leaves_replaced);
CAB_SAME_MEMBER(FrameStats, seconds_update);
CAB_SAME_MEMBER(FrameStats, seconds_broad);
CAB_SAME_MEMBER(FrameStats, seconds_test);
CAB_SAME_MEMBER(FrameStats, seconds_query);
CAB_SAME_MEMBER(FrameStats, seconds_contact);
CAB_SAME_MEMBER(FrameStats, seconds_total);
CAB_SAME_MEMBER(FrameStats, instances_posed);
CAB_SAME_MEMBER(FrameStats, candidates_apart);
CAB_SAME_MEMBER(FrameStats, seconds_bound);
CAB_SAME_MEMBER(FrameStats, seconds_sort);
CAB_SAME_MEMBER(FrameStats, seconds_filter);
CAB_SAME_MEMBER(FrameStats, seconds_write);
CAB_SAME_TYPE(FrameJob);
CAB_SAME_MEMBER(FrameJob, inputs);
CAB_SAME_MEMBER(FrameJob, rules);
CAB_SAME_MEMBER(FrameJob, policies);
CAB_SAME_MEMBER(FrameJob, margin);
CAB_SAME_MEMBER(FrameJob, min_depth);
CAB_SAME_MEMBER(FrameJob, report);
CAB_SAME_MEMBER(FrameJob, containment);
CAB_SAME_MEMBER(FrameJob, hits);
CAB_SAME_MEMBER(FrameJob, contacts);
CAB_SAME_MEMBER(FrameJob, hit_count);
CAB_SAME_MEMBER(FrameJob, hits_needed);
CAB_SAME_MEMBER(FrameJob, stats);
CAB_SAME_TYPE(Allocator);
CAB_SAME_MEMBER(Allocator, user);
CAB_SAME_MEMBER(Allocator, allocate);
CAB_SAME_MEMBER(Allocator, release);
CAB_SAME_TYPE(Scheduler);
CAB_SAME_MEMBER(Scheduler, user);
CAB_SAME_MEMBER(Scheduler, worker_count);
CAB_SAME_MEMBER(Scheduler, parallel_for);
CAB_SAME_TYPE(Profiler);
CAB_SAME_MEMBER(Profiler, user);
CAB_SAME_MEMBER(Profiler, begin);
CAB_SAME_MEMBER(Profiler, end);
CAB_SAME_TYPE(EngineDesc);
CAB_SAME_MEMBER(EngineDesc, isa);
CAB_SAME_MEMBER(EngineDesc, thread_count);
CAB_SAME_MEMBER(EngineDesc, allocator);
CAB_SAME_MEMBER(EngineDesc, scheduler);
CAB_SAME_MEMBER(EngineDesc, profiler);
CAB_SAME_TYPE(JointDesc);
CAB_SAME_MEMBER(JointDesc, kind);
CAB_SAME_MEMBER(JointDesc, variable);
CAB_SAME_MEMBER(JointDesc, axis);
CAB_SAME_MEMBER(JointDesc, anchor);
CAB_SAME_MEMBER(JointDesc, multiplier);
CAB_SAME_MEMBER(JointDesc, offset);
CAB_SAME_TYPE(LinkPlaceDesc);
CAB_SAME_MEMBER(LinkPlaceDesc, rotation);
CAB_SAME_MEMBER(LinkPlaceDesc, translation);
CAB_SAME_MEMBER(LinkPlaceDesc, joint_count);
CAB_SAME_TYPE(KinematicsDesc);
CAB_SAME_MEMBER(KinematicsDesc, link_parents);
CAB_SAME_MEMBER(KinematicsDesc, links);
CAB_SAME_MEMBER(KinematicsDesc, joints);
CAB_SAME_MEMBER(KinematicsDesc, variable_count);
CAB_SAME_TYPE(HistoryId);
CAB_SAME_MEMBER(HistoryId, value);
CAB_SAME_TYPE(HistoryDesc);
CAB_SAME_MEMBER(HistoryDesc, batch);
CAB_SAME_MEMBER(HistoryDesc, ticks);
CAB_SAME_TYPE(HistorySpan);
CAB_SAME_MEMBER(HistorySpan, ticks);
CAB_SAME_MEMBER(HistorySpan, first);
CAB_SAME_MEMBER(HistorySpan, last);
CAB_SAME_TYPE(Query);
CAB_SAME_MEMBER(Query, kind);
CAB_SAME_MEMBER(Query, want);
CAB_SAME_MEMBER(Query, with_depth);
CAB_SAME_MEMBER(Query, max_hits);
CAB_SAME_MEMBER(Query, layer_mask);
CAB_SAME_MEMBER(Query, ignored_batch);
CAB_SAME_MEMBER(Query, ignored_instance);
CAB_SAME_MEMBER(Query, time);
CAB_SAME_MEMBER(Query, position);
CAB_SAME_MEMBER(Query, orientation);
CAB_SAME_MEMBER(Query, direction);
CAB_SAME_MEMBER(Query, length);
CAB_SAME_MEMBER(Query, radius);
CAB_SAME_MEMBER(Query, half);
CAB_SAME_MEMBER(Query, first_plane);
CAB_SAME_MEMBER(Query, plane_count);
CAB_SAME_TYPE(QueryPlane);
CAB_SAME_MEMBER(QueryPlane, normal);
CAB_SAME_MEMBER(QueryPlane, offset);
CAB_SAME_TYPE(QueryHit);
CAB_SAME_MEMBER(QueryHit, query);
CAB_SAME_MEMBER(QueryHit, batch);
CAB_SAME_MEMBER(QueryHit, instance);
CAB_SAME_MEMBER(QueryHit, link);
CAB_SAME_MEMBER(QueryHit, leaf);
CAB_SAME_MEMBER(QueryHit, distance);
CAB_SAME_MEMBER(QueryHit, point);
CAB_SAME_MEMBER(QueryHit, normal);
CAB_SAME_MEMBER(QueryHit, inside);
CAB_SAME_TYPE(QueryLink);
CAB_SAME_MEMBER(QueryLink, query);
CAB_SAME_MEMBER(QueryLink, batch);
CAB_SAME_MEMBER(QueryLink, instance);
CAB_SAME_MEMBER(QueryLink, link);
CAB_SAME_MEMBER(QueryLink, leaf);
CAB_SAME_TYPE(SurfacePoint);
CAB_SAME_MEMBER(SurfacePoint, triangle);
CAB_SAME_MEMBER(SurfacePoint, weights);
CAB_SAME_TYPE(QueryStats);
CAB_SAME_MEMBER(QueryStats, nodes);
CAB_SAME_MEMBER(QueryStats, instances);
CAB_SAME_MEMBER(QueryStats, leaf_tests);
CAB_SAME_MEMBER(QueryStats, exact_tests);
CAB_SAME_MEMBER(QueryStats, leaves_skinned);
CAB_SAME_MEMBER(QueryStats, leaves_replaced);
CAB_SAME_MEMBER(QueryStats, instances_posed);
CAB_SAME_MEMBER(QueryStats, instances_masked);
CAB_SAME_MEMBER(QueryStats, clamped);
CAB_SAME_MEMBER(QueryStats, seconds_bound);
CAB_SAME_MEMBER(QueryStats, seconds_index);
CAB_SAME_MEMBER(QueryStats, seconds_search);
CAB_SAME_MEMBER(QueryStats, seconds_total);
CAB_SAME_TYPE(QueryJob);
CAB_SAME_MEMBER(QueryJob, inputs);
CAB_SAME_MEMBER(QueryJob, histories);
CAB_SAME_MEMBER(QueryJob, queries);
CAB_SAME_MEMBER(QueryJob, planes);
CAB_SAME_MEMBER(QueryJob, exact);
CAB_SAME_MEMBER(QueryJob, reuse_bounds);
CAB_SAME_MEMBER(QueryJob, hits);
CAB_SAME_MEMBER(QueryJob, surface_points);
CAB_SAME_MEMBER(QueryJob, links);
CAB_SAME_MEMBER(QueryJob, counts);
CAB_SAME_MEMBER(QueryJob, found);
CAB_SAME_MEMBER(QueryJob, hit_count);
CAB_SAME_MEMBER(QueryJob, hits_needed);
CAB_SAME_MEMBER(QueryJob, bad_query);
CAB_SAME_MEMBER(QueryJob, stats);
CAB_SAME_TYPE(Policies);
CAB_SAME_MEMBER(Policies, refit);
CAB_SAME_MEMBER(Policies, strategy);
CAB_SAME_MEMBER(Policies, exact);
CAB_SAME_MEMBER(Policies, extents);
CAB_SAME_MEMBER(Policies, sat);
CAB_SAME_TYPE(PolicyValue);
CAB_SAME_MEMBER(PolicyValue, value);
CAB_SAME_MEMBER(PolicyValue, name);
CAB_SAME_MEMBER(PolicyValue, meaning);
CAB_SAME_TYPE(PolicyField);
CAB_SAME_MEMBER(PolicyField, name);
CAB_SAME_MEMBER(PolicyField, meaning);
CAB_SAME_MEMBER(PolicyField, values);
CAB_SAME_MEMBER(PolicyField, value_count);
CAB_SAME_MEMBER(PolicyField, use_count);
CAB_SAME_TYPE(PolicyPreset);
CAB_SAME_MEMBER(PolicyPreset, name);
CAB_SAME_MEMBER(PolicyPreset, meaning);
CAB_SAME_MEMBER(PolicyPreset, policies);
CAB_SAME_TYPE(BoxLine);
CAB_SAME_MEMBER(BoxLine, from);
CAB_SAME_MEMBER(BoxLine, to);
CAB_SAME_MEMBER(BoxLine, instance);
CAB_SAME_MEMBER(BoxLine, node);
CAB_SAME_MEMBER(BoxLine, link);
CAB_SAME_MEMBER(BoxLine, is_hit);
CAB_SAME_TYPE(BoxLinesJob);
CAB_SAME_MEMBER(BoxLinesJob, policies);
CAB_SAME_MEMBER(BoxLinesJob, level);
CAB_SAME_MEMBER(BoxLinesJob, shapes);
CAB_SAME_MEMBER(BoxLinesJob, hits);
CAB_SAME_MEMBER(BoxLinesJob, contacts);
CAB_SAME_MEMBER(BoxLinesJob, origin);
CAB_SAME_MEMBER(BoxLinesJob, lines);
CAB_SAME_MEMBER(BoxLinesJob, line_count);
CAB_SAME_MEMBER(BoxLinesJob, lines_needed);
CAB_SAME_TYPE(Version);
CAB_SAME_MEMBER(Version, major);
CAB_SAME_MEMBER(Version, minor);
CAB_SAME_MEMBER(Version, patch);
CAB_SAME_MEMBER(Version, text);
CAB_SAME_TYPE(BuildInfo);
CAB_SAME_MEMBER(BuildInfo, fcl);
CAB_SAME_MEMBER(BuildInfo, qhull);
CAB_SAME_MEMBER(BuildInfo, tbb);
CAB_SAME_SPAN(cab_ConstDoubleSpan);
CAB_SAME_SPAN(cab_ConstFloatSpan);
CAB_SAME_SPAN(cab_ConstConvexPartSpan);
CAB_SAME_SPAN(cab_ConstUint32Span);
CAB_SAME_SPAN(cab_ConstInt32Span);
CAB_SAME_SPAN(cab_ConstLeafSpan);
CAB_SAME_SPAN(cab_ConstLinkPairSpan);
CAB_SAME_SPAN(cab_ConstLodLeafSpan);
CAB_SAME_SPAN(cab_ConstStaticBodySpan);
CAB_SAME_SPAN(cab_Uint8Span);
CAB_SAME_SPAN(cab_ConstUint8Span);
CAB_SAME_SPAN(cab_InstancePairSpan);
CAB_SAME_SPAN(cab_HitSpan);
CAB_SAME_SPAN(cab_ConstBatchInputSpan);
CAB_SAME_SPAN(cab_ConstPairRuleSpan);
CAB_SAME_SPAN(cab_ContactSpan);
CAB_SAME_SPAN(cab_ConstLinkPlaceDescSpan);
CAB_SAME_SPAN(cab_ConstJointDescSpan);
CAB_SAME_SPAN(cab_ConstHistoryIdSpan);
CAB_SAME_SPAN(cab_ConstQuerySpan);
CAB_SAME_SPAN(cab_ConstQueryPlaneSpan);
CAB_SAME_SPAN(cab_QueryHitSpan);
CAB_SAME_SPAN(cab_SurfacePointSpan);
CAB_SAME_SPAN(cab_QueryLinkSpan);
CAB_SAME_SPAN(cab_Uint32Span);
CAB_SAME_SPAN(cab_ConstHitSpan);
CAB_SAME_SPAN(cab_ConstContactSpan);
CAB_SAME_SPAN(cab_BoxLineSpan);
CAB_SAME_SPAN(cab_ConstPolicyFieldSpan);
CAB_SAME_SPAN(cab_ConstPolicyPresetSpan);
CAB_SAME_SPAN(cab_FloatSpan);
CAB_SAME_SPAN(cab_Uint16Span);
CAB_SAME_SPAN(cab_BoxSpan);
CAB_SAME_SPAN(cab_TouchingTrianglesSpan);
CAB_SAME_SPAN(cab_CharSpan);
CAB_SAME_SPAN(cab_MergeStepSpan);
CAB_SAME_SPAN(cab_IgnoredPairSpan);

}  // namespace
}  // namespace cab

extern "C" {

cab_ConstPolicyFieldSpan cab_policy_table(void) { return cab::as<cab_ConstPolicyFieldSpan>(cab::policy_table()); }

uint32_t cab_policy_get(const cab_Policies* policies, uint32_t field) {
  if (!policies) return 0;
  return cab::policy_get(*cab::at<const cab::Policies>(policies), field);
}

bool cab_policy_set(cab_Policies* policies, uint32_t field, const char* value_name) {
  if (!policies) return false;
  return cab::policy_set(*cab::at<cab::Policies>(policies), field, value_name);
}

cab_ConstPolicyPresetSpan cab_preset_table(void) { return cab::as<cab_ConstPolicyPresetSpan>(cab::preset_table()); }

bool cab_preset_set(cab_Policies* policies, const char* preset_name) {
  if (!policies) return false;
  return cab::preset_set(*cab::at<cab::Policies>(policies), preset_name);
}

cab_Version cab_version(void) { return cab::as<cab_Version>(cab::version()); }

cab_BuildInfo cab_build_info(void) { return cab::as<cab_BuildInfo>(cab::build_info()); }

cab_Status cab_create_engine(uint32_t abi_version, const cab_EngineDesc* desc, cab_Engine** out) {
  if (abi_version != CAB_ABI_VERSION) return CAB_STATUS_BAD_ABI_VERSION;
  if (!desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::create_engine(*cab::at<const cab::EngineDesc>(desc), cab::at<cab::Engine*>(out)));
}

void cab_destroy_engine(cab_Engine* engine) { cab::destroy_engine(cab::at<cab::Engine>(engine)); }

cab_Status cab_add_articulation(cab_Engine* engine, const cab_ArticulationDesc* desc, cab_ArticulationId* out,
                                uint32_t* bad_element) {
  if (!engine || !desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::add_articulation(*cab::at<cab::Engine>(engine),
                                                   *cab::at<const cab::ArticulationDesc>(desc),
                                                   cab::at<cab::ArticulationId>(out), bad_element));
}

cab_Status cab_fit_box(cab_ConstFloatSpan vertices, cab_Box* out) {
  return cab::as<cab_Status>(cab::fit_box(cab::as<cab::Span<const float>>(vertices), cab::at<cab::Box>(out)));
}

cab_Status cab_compute_link_poses(const cab_KinematicsDesc* desc, cab_ConstDoubleSpan states, cab_Isa isa,
                                  cab_FloatSpan poses) {
  if (!desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::compute_link_poses(*cab::at<const cab::KinematicsDesc>(desc),
                                                     cab::as<cab::Span<const double>>(states), cab::as<cab::Isa>(isa),
                                                     cab::as<cab::Span<float>>(poses)));
}

cab_Status cab_add_lod(cab_Engine* engine, const cab_LodDesc* desc, cab_ArticulationId* out, uint32_t* bad_leaf) {
  if (!engine || !desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::add_lod(*cab::at<cab::Engine>(engine), *cab::at<const cab::LodDesc>(desc),
                                          cab::at<cab::ArticulationId>(out), bad_leaf));
}

cab_Status cab_lod_leaves(const cab_Engine* engine, cab_ArticulationId level, cab_Uint16Span leaf_of_link) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::lod_leaves(*cab::at<const cab::Engine>(engine), cab::as<cab::ArticulationId>(level),
                                             cab::as<cab::Span<std::uint16_t>>(leaf_of_link)));
}

cab_Status cab_add_batch(cab_Engine* engine, const cab_BatchDesc* desc, cab_BatchId* out) {
  if (!engine || !desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(
      cab::add_batch(*cab::at<cab::Engine>(engine), *cab::at<const cab::BatchDesc>(desc), cab::at<cab::BatchId>(out)));
}

cab_Status cab_add_static_batch(cab_Engine* engine, const cab_StaticDesc* desc, cab_BatchId* out,
                                uint32_t* bad_element) {
  if (!engine || !desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::add_static_batch(*cab::at<cab::Engine>(engine), *cab::at<const cab::StaticDesc>(desc),
                                                   cab::at<cab::BatchId>(out), bad_element));
}

cab_Status cab_reserve(cab_Engine* engine, const cab_ReserveDesc* desc) {
  if (!engine || !desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::reserve(*cab::at<cab::Engine>(engine), *cab::at<const cab::ReserveDesc>(desc)));
}

cab_Status cab_remove_batch(cab_Engine* engine, cab_BatchId id) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::remove_batch(*cab::at<cab::Engine>(engine), cab::as<cab::BatchId>(id)));
}

cab_Status cab_remove_articulation(cab_Engine* engine, cab_ArticulationId id) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::remove_articulation(*cab::at<cab::Engine>(engine), cab::as<cab::ArticulationId>(id)));
}

cab_Status cab_run_frame(cab_Engine* engine, cab_FrameJob* job) {
  if (!engine || !job) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::run_frame(*cab::at<cab::Engine>(engine), *cab::at<cab::FrameJob>(job)));
}

cab_Status cab_begin_frame(cab_Engine* engine, cab_FrameJob* job) {
  if (!engine || !job) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::begin_frame(*cab::at<cab::Engine>(engine), *cab::at<cab::FrameJob>(job)));
}

cab_Status cab_next_tasks(cab_Engine* engine, uint32_t* count) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::next_tasks(*cab::at<cab::Engine>(engine), count));
}

cab_Status cab_run_task(cab_Engine* engine, uint32_t task, uint32_t worker) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::run_task(*cab::at<cab::Engine>(engine), task, worker));
}

cab_Status cab_end_frame(cab_Engine* engine) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::end_frame(*cab::at<cab::Engine>(engine)));
}

cab_Status cab_find_candidates(cab_Engine* engine, const cab_FrameJob* job, cab_CandidateList* out) {
  if (!engine || !job || !out) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::find_candidates(*cab::at<cab::Engine>(engine), *cab::at<const cab::FrameJob>(job),
                                                  *cab::at<cab::CandidateList>(out)));
}

cab_Status cab_run_queries(cab_Engine* engine, cab_QueryJob* job) {
  if (!engine || !job) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::run_queries(*cab::at<cab::Engine>(engine), *cab::at<cab::QueryJob>(job)));
}

cab_Status cab_add_history(cab_Engine* engine, const cab_HistoryDesc* desc, cab_HistoryId* out) {
  if (!engine || !desc) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::add_history(*cab::at<cab::Engine>(engine), *cab::at<const cab::HistoryDesc>(desc),
                                              cab::at<cab::HistoryId>(out)));
}

cab_Status cab_remove_history(cab_Engine* engine, cab_HistoryId id) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::remove_history(*cab::at<cab::Engine>(engine), cab::as<cab::HistoryId>(id)));
}

cab_Status cab_record_tick(cab_Engine* engine, cab_HistoryId id, const cab_BatchInput* input, double time) {
  if (!engine || !input) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::record_tick(*cab::at<cab::Engine>(engine), cab::as<cab::HistoryId>(id),
                                              *cab::at<const cab::BatchInput>(input), time));
}

cab_Status cab_history_span(const cab_Engine* engine, cab_HistoryId id, cab_HistorySpan* out) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::history_span(*cab::at<const cab::Engine>(engine), cab::as<cab::HistoryId>(id),
                                               cab::at<cab::HistorySpan>(out)));
}

cab_Status cab_sweep_margins(cab_Engine* engine, const cab_BatchInput* last, const cab_BatchInput* input,
                             cab_FloatSpan margins) {
  if (!engine || !last || !input) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::sweep_margins(*cab::at<cab::Engine>(engine), *cab::at<const cab::BatchInput>(last),
                                                *cab::at<const cab::BatchInput>(input),
                                                cab::as<cab::Span<float>>(margins)));
}

cab_Status cab_find_touching_moments(cab_Engine* engine, cab_ConstBatchInputSpan last, cab_ConstBatchInputSpan inputs,
                                     float resolution, cab_ConstHitSpan pairs, cab_FloatSpan moments) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(
      cab::find_touching_moments(*cab::at<cab::Engine>(engine), cab::as<cab::Span<const cab::BatchInput>>(last),
                                 cab::as<cab::Span<const cab::BatchInput>>(inputs), resolution,
                                 cab::as<cab::Span<const cab::Hit>>(pairs), cab::as<cab::Span<float>>(moments)));
}

cab_Status cab_compute_boxes(cab_Engine* engine, const cab_BatchInput* input, const cab_Policies* policies,
                             cab_BoxSpan boxes) {
  if (!engine || !input || !policies) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::compute_boxes(*cab::at<cab::Engine>(engine), *cab::at<const cab::BatchInput>(input),
                                                *cab::at<const cab::Policies>(policies),
                                                cab::as<cab::Span<cab::Box>>(boxes)));
}

cab_Status cab_compute_contacts(cab_Engine* engine, cab_ConstBatchInputSpan inputs, cab_ConstHitSpan pairs,
                                cab_ContactSpan contacts) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(
      cab::compute_contacts(*cab::at<cab::Engine>(engine), cab::as<cab::Span<const cab::BatchInput>>(inputs),
                            cab::as<cab::Span<const cab::Hit>>(pairs), cab::as<cab::Span<cab::Contact>>(contacts)));
}

cab_Status cab_find_touching_triangles(cab_Engine* engine, cab_ConstBatchInputSpan inputs, cab_ConstHitSpan pairs,
                                       cab_TouchingTrianglesSpan out, size_t* found) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::find_touching_triangles(
      *cab::at<cab::Engine>(engine), cab::as<cab::Span<const cab::BatchInput>>(inputs),
      cab::as<cab::Span<const cab::Hit>>(pairs), cab::as<cab::Span<cab::TouchingTriangles>>(out), found));
}

cab_Status cab_why_masked(cab_Engine* engine, const cab_BatchInput* input, uint32_t instance, cab_MaskReason* out) {
  if (!engine || !input) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::why_masked(*cab::at<cab::Engine>(engine), *cab::at<const cab::BatchInput>(input),
                                             instance, cab::at<cab::MaskReason>(out)));
}

size_t cab_explain_job(cab_Engine* engine, const cab_FrameJob* job, cab_CharSpan text) {
  if (!engine || !job) return 0;
  return cab::explain_job(*cab::at<cab::Engine>(engine), *cab::at<const cab::FrameJob>(job),
                          cab::as<cab::Span<char>>(text));
}

size_t cab_explain_mask(const cab_MaskReason* reason, cab_CharSpan text) {
  if (!reason) return 0;
  return cab::explain_mask(*cab::at<const cab::MaskReason>(reason), cab::as<cab::Span<char>>(text));
}

size_t cab_stats_line(const cab_FrameStats* stats, cab_CharSpan text) {
  if (!stats) return 0;
  return cab::stats_line(*cab::at<const cab::FrameStats>(stats), cab::as<cab::Span<char>>(text));
}

cab_Status cab_box_lines(cab_Engine* engine, const cab_BatchInput* input, cab_BoxLinesJob* job) {
  if (!engine || !input || !job) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::box_lines(*cab::at<cab::Engine>(engine), *cab::at<const cab::BatchInput>(input),
                                            *cab::at<cab::BoxLinesJob>(job)));
}

cab_Status cab_diff_hits(cab_ConstHitSpan previous, cab_ConstHitSpan current, cab_HitChanges* changes) {
  if (!changes) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::diff_hits(cab::as<cab::Span<const cab::Hit>>(previous),
                                            cab::as<cab::Span<const cab::Hit>>(current),
                                            *cab::at<cab::HitChanges>(changes)));
}

cab_Status cab_spatial_order(cab_Engine* engine, cab_BatchId batch, cab_Uint32Span order) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::spatial_order(*cab::at<cab::Engine>(engine), cab::as<cab::BatchId>(batch),
                                                cab::as<cab::Span<std::uint32_t>>(order)));
}

cab_Status cab_articulation_info(const cab_Engine* engine, cab_ArticulationId id, cab_ArticulationInfo* out) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::articulation_info(
      *cab::at<const cab::Engine>(engine), cab::as<cab::ArticulationId>(id), cab::at<cab::ArticulationInfo>(out)));
}

cab_Status cab_batch_info(const cab_Engine* engine, cab_BatchId id, cab_BatchInfo* out) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(
      cab::batch_info(*cab::at<const cab::Engine>(engine), cab::as<cab::BatchId>(id), cab::at<cab::BatchInfo>(out)));
}

cab_Status cab_merge_steps(const cab_Engine* engine, cab_ArticulationId id, cab_MergeStepSpan steps) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::merge_steps(*cab::at<const cab::Engine>(engine), cab::as<cab::ArticulationId>(id),
                                              cab::as<cab::Span<cab::MergeStep>>(steps)));
}

cab_Status cab_ignored_pairs(const cab_Engine* engine, cab_ArticulationId id, cab_IgnoredPairSpan pairs) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::ignored_pairs(*cab::at<const cab::Engine>(engine), cab::as<cab::ArticulationId>(id),
                                                cab::as<cab::Span<cab::IgnoredPair>>(pairs)));
}

cab_Status cab_engine_memory(const cab_Engine* engine, cab_EngineMemory* out) {
  if (!engine) return CAB_STATUS_NULL_ARGUMENT;
  return cab::as<cab_Status>(cab::engine_memory(*cab::at<const cab::Engine>(engine), cab::at<cab::EngineMemory>(out)));
}

uint32_t cab_engine_thread_count(const cab_Engine* engine) {
  if (!engine) return 0;
  return cab::engine_thread_count(*cab::at<const cab::Engine>(engine));
}

cab_Isa cab_engine_isa(const cab_Engine* engine) {
  if (!engine) return 0;
  return cab::as<cab_Isa>(cab::engine_isa(*cab::at<const cab::Engine>(engine)));
}

bool cab_isa_available(cab_Isa isa) { return cab::isa_available(cab::as<cab::Isa>(isa)); }

const char* cab_isa_to_string(cab_Isa isa) { return cab::to_string(cab::as<cab::Isa>(isa)); }

const char* cab_status_to_string(cab_Status status) { return cab::to_string(cab::as<cab::Status>(status)); }

cab_Box cab_default_box(void) { return cab::as<cab_Box>(cab::Box()); }

cab_PoseView cab_default_pose_view(void) { return cab::as<cab_PoseView>(cab::PoseView()); }

cab_StateView cab_default_state_view(void) { return cab::as<cab_StateView>(cab::StateView()); }

cab_ConvexPart cab_default_convex_part(void) { return cab::as<cab_ConvexPart>(cab::ConvexPart()); }

cab_Leaf cab_default_leaf(void) { return cab::as<cab_Leaf>(cab::Leaf()); }

cab_SkinDesc cab_default_skin_desc(void) { return cab::as<cab_SkinDesc>(cab::SkinDesc()); }

cab_ArticulationDesc cab_default_articulation_desc(void) {
  return cab::as<cab_ArticulationDesc>(cab::ArticulationDesc());
}

cab_LodLeaf cab_default_lod_leaf(void) { return cab::as<cab_LodLeaf>(cab::LodLeaf()); }

cab_LodDesc cab_default_lod_desc(void) { return cab::as<cab_LodDesc>(cab::LodDesc()); }

cab_BatchDesc cab_default_batch_desc(void) { return cab::as<cab_BatchDesc>(cab::BatchDesc()); }

cab_StaticBody cab_default_static_body(void) { return cab::as<cab_StaticBody>(cab::StaticBody()); }

cab_StaticDesc cab_default_static_desc(void) { return cab::as<cab_StaticDesc>(cab::StaticDesc()); }

cab_ReserveDesc cab_default_reserve_desc(void) { return cab::as<cab_ReserveDesc>(cab::ReserveDesc()); }

cab_BatchInput cab_default_batch_input(void) { return cab::as<cab_BatchInput>(cab::BatchInput()); }

cab_PairRule cab_default_pair_rule(void) { return cab::as<cab_PairRule>(cab::PairRule()); }

cab_CandidateList cab_default_candidate_list(void) { return cab::as<cab_CandidateList>(cab::CandidateList()); }

cab_HitChanges cab_default_hit_changes(void) { return cab::as<cab_HitChanges>(cab::HitChanges()); }

cab_FrameJob cab_default_frame_job(void) { return cab::as<cab_FrameJob>(cab::FrameJob()); }

cab_Allocator cab_default_allocator(void) { return cab::as<cab_Allocator>(cab::Allocator()); }

cab_Scheduler cab_default_scheduler(void) { return cab::as<cab_Scheduler>(cab::Scheduler()); }

cab_EngineDesc cab_default_engine_desc(void) { return cab::as<cab_EngineDesc>(cab::EngineDesc()); }

cab_JointDesc cab_default_joint_desc(void) { return cab::as<cab_JointDesc>(cab::JointDesc()); }

cab_LinkPlaceDesc cab_default_link_place_desc(void) { return cab::as<cab_LinkPlaceDesc>(cab::LinkPlaceDesc()); }

cab_KinematicsDesc cab_default_kinematics_desc(void) { return cab::as<cab_KinematicsDesc>(cab::KinematicsDesc()); }

cab_HistoryDesc cab_default_history_desc(void) { return cab::as<cab_HistoryDesc>(cab::HistoryDesc()); }

cab_Query cab_default_query(void) { return cab::as<cab_Query>(cab::Query()); }

cab_QueryPlane cab_default_query_plane(void) { return cab::as<cab_QueryPlane>(cab::QueryPlane()); }

cab_QueryJob cab_default_query_job(void) { return cab::as<cab_QueryJob>(cab::QueryJob()); }

cab_Policies cab_default_policies(void) { return cab::as<cab_Policies>(cab::Policies()); }

cab_BoxLinesJob cab_default_box_lines_job(void) { return cab::as<cab_BoxLinesJob>(cab::BoxLinesJob()); }

cab_BatchSlot cab_slot_of(cab_BatchId id) { return {cab::slot_of({id.value}).value}; }

}  // extern "C"
