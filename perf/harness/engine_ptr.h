// An engine with one owner.
#pragma once

#include <cab/cab.h>

#include <memory>

namespace cab::oracle {

struct DestroyEngine {
  void operator()(Engine* engine) const { destroy_engine(engine); }
};
using EnginePtr = std::unique_ptr<Engine, DestroyEngine>;

}  // namespace cab::oracle
