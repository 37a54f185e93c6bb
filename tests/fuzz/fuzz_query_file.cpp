// Turns bytes into the text of a file of queries, of the kind that the first byte chooses. The answer is queries that
// run_queries accepts, or one printable line that names the file.
#include "perf/tools/query/query_file.h"
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"

#include <cab/cab.h>

#include <memory>
#include <vector>

namespace {

using namespace cab;
using namespace cab::perf;

struct Destroy {
  void operator()(Engine* engine) const { destroy_engine(engine); }
};

// Asks the queries of an engine that is empty.
Status ask(const std::vector<Query>& queries) {
  static const std::unique_ptr<Engine, Destroy> engine = [] {
    Engine* made = nullptr;
    ReserveDesc room;
    room.queries = 64;
    FUZZ_CHECK(create_engine({}, &made) == Status::kOk && reserve(*made, room) == Status::kOk);
    return std::unique_ptr<Engine, Destroy>(made);
  }();
  QueryJob job;
  job.queries = queries;
  return run_queries(*engine, job);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMost = 100;
  fuzz::Bytes bytes(data, size);
  const QueryKind kind = kFileKinds[bytes.below(kFileKindCount)];
  const std::string text = bytes.rest();
  try {
    const std::vector<Query> queries = parse_queries(kind, text, "q.csv", kMost);
    FUZZ_CHECK(!queries.empty() && queries.size() <= kMost);
    for (const Query& query : queries) FUZZ_CHECK(query.kind == kind);
    FUZZ_CHECK(ask(queries) == Status::kOk);
  } catch (const scenes::ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind("q.csv:", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
