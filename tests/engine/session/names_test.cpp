// Each status and each instruction set has its own words. Header, library and CMake have one version.
#include <cab/cab.h>

#include <doctest/doctest.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>

using namespace cab;

TEST_CASE("every status has its own words, and a number beyond them is no status") {
  const std::string none = to_string(static_cast<Status>(-1));
  CHECK(to_string(static_cast<Status>(static_cast<int>(Status::kSkinNotTaken) + 1)) == none);
  std::set<std::string> words;
  for (int status = 0; status <= static_cast<int>(Status::kSkinNotTaken); ++status) {
    const std::string word = to_string(static_cast<Status>(status));
    CAPTURE(word);
    CHECK(!word.empty());
    CHECK(word != none);
    CHECK(words.insert(word).second);
  }
}

TEST_CASE(
    "the comment of every status in cab/types.h is what to_string says, and the headers say which calls answer it") {
  std::ifstream types(CAB_DOCS "/../layout/include/cab/types.h"), calls(CAB_DOCS "/../layout/include/cab/cab.h");
  std::ifstream c_calls(CAB_DOCS "/../layout/include/cab/cab_c.h");
  std::string call_text{std::istreambuf_iterator<char>(calls), {}};
  const std::string c_text{std::istreambuf_iterator<char>(c_calls), {}};
  // What only the C API answers is said there.
  if (c_text.find("refused with CAB_STATUS_BAD_ABI_VERSION") != std::string::npos) call_text += "kBadAbiVersion";
  if (c_text.find("calls answer\n//             CAB_STATUS_NULL_ARGUMENT") != std::string::npos)
    call_text += "kNullArgument";
  std::string line;
  while (std::getline(types, line) && line.rfind("enum class Status ", 0) != 0) call_text += line;  // input statuses
  REQUIRE(types);
  int status = 0;
  for (; std::getline(types, line) && line != "};"; ++status) {
    CAPTURE(line);
    const std::size_t comment = line.find("// ");
    REQUIRE(comment != std::string::npos);
    CHECK(line.substr(comment + 3) == to_string(static_cast<Status>(status)));
    const std::string name = line.substr(2, line.find_first_of(" ,", 2) - 2);
    if (name != "kOk") CHECK(call_text.find(name) != std::string::npos);
  }
  CHECK(status == static_cast<int>(Status::kSkinNotTaken) + 1);
}

TEST_CASE("the words of a status begin with a small letter and end without a period") {
  for (int status = 0; status <= static_cast<int>(Status::kSkinNotTaken); ++status) {
    const std::string words = to_string(static_cast<Status>(status));
    CAPTURE(words);
    CHECK(words.front() >= 'a');
    CHECK(words.front() <= 'z');
    CHECK(words.back() != '.');
  }
}

TEST_CASE("every instruction set has its own name") {
  std::set<std::string> names;
  for (std::uint32_t isa = 0; isa < kIsaCount; ++isa) CHECK(names.insert(to_string(static_cast<Isa>(isa))).second);
  CHECK(names == std::set<std::string>{"auto", "scalar", "sse2", "avx2", "avx512", "neon64", "wasm128"});
  CHECK(names.count(to_string(static_cast<Isa>(kIsaCount))) == 0);
}

TEST_CASE("the header, the library and the project of CMake are of one version") {
  const Version library = version();
  CHECK(library.major == CAB_VERSION_MAJOR);
  CHECK(library.minor == CAB_VERSION_MINOR);
  CHECK(library.patch == CAB_VERSION_PATCH);
  CHECK(library.text == std::string(CAB_VERSION_STRING));
  CHECK(library.text == std::to_string(library.major) + "." + std::to_string(library.minor) + "." +
                            std::to_string(library.patch) + CAB_VERSION_SUFFIX);
  CHECK(library.text == std::string(CAB_PROJECT_VERSION));
}

TEST_CASE("scalar kernels and the best of this CPU are always available") {
  CHECK(isa_available(Isa::kScalar));
  CHECK(isa_available(Isa::kAuto));
  CHECK_FALSE(isa_available(static_cast<Isa>(kIsaCount)));
}
