// Which characters rest: what the engine keeps from one frame to the next.
#pragma once

#include "engine/session/engine.h"

namespace cab {

// Whether frames compare what rests with the frame before.
#ifdef NDEBUG
inline constexpr bool kChecksRest = false;
#else
inline constexpr bool kChecksRest = true;
#endif

// Takes note of what a frame answers, and returns it. After anything but kOk all instances count as moved in the next
// frame. Any thread may call this beside other calls on the engine, as kBusy is answered.
Status note_answer(Engine& engine, Status status);

// Starts a frame whose inputs are bound and whose job is valid: decides in which batches instances may rest.
// failed_before: Engine::frames_failed before the frame was let in, so that a call that is refused meanwhile counts for
// the next frame. Answers kMovedAtRest if a check finds one that has changed.
Status begin_rest(Engine& engine, const FrameJob& job, std::uint64_t failed_before);

// Ends a frame that answered kOk: its instances may rest in the next one.
void end_rest(Engine& engine, const FrameJob& job);

// Lets every instance count as moved in the next frame, which finds all its hits itself.
void forget_rest(Engine& engine);

}  // namespace cab
