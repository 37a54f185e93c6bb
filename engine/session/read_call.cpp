// How a call that reads gets a reader, apart from call.cpp: the command of a shared build has a copy of run_all_pairs
// and so of call.cpp, but not of what makes readers.
#include "engine/session/call.h"
#include "engine/session/memory.h"

namespace cab {
namespace {

// A reader that no read uses, or null. The first one has the engine's threads.
Reader* free_reader(const Engine& engine, bool needs_threads) {
  Reader* out = nullptr;
  for (const auto& reader : engine.readers)
    if (!reader->in_use && (!out || !needs_threads)) out = reader.get();
  return out;
}

}  // namespace

Call::Call(Engine& engine, Access access) : engine_(engine) {
  Holders& holders = engine.holders;
  {
    const std::lock_guard lock(holders.mutex);
    if (holders.is_changing) return;
    ++holders.reading;
    reader_ = free_reader(engine, access == Access::kReads);
    if (reader_) reader_->in_use = true;
  }
  if (!reader_) {
    try {
      reader_ = &add_reader(engine);
    } catch (...) {
      const std::lock_guard lock(holders.mutex);
      --holders.reading;
      throw;
    }
  }
  admitted_ = true;
}

}  // namespace cab
