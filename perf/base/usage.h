// Wrong use of the command line.
#pragma once

#include <cab/types.h>

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace cab::perf {

// Wrong use of the command line: exit code 2. what() is one line that names the option and says what is allowed. Every
// other exception is bad data or a failure: exit code 1.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An option that names a file to write. The path is empty if the option is not given.
struct OutputOption {
  const char* option;
  std::string path;
};

// Throws UsageError unless an option is given never, once, or once for each of `count` files or clips, as `noun` says.
void check_given(const std::string& option, std::size_t given, std::size_t count, const std::string& noun);

// Throws UsageError if an output is "-", which may mean standard output, if two outputs are one file, or if an output
// is also an input, by whatever names: ./x and x, links, or one file that has two names. Paths that are empty are
// ignored. companions(input): what an input is read with, which is an input too; it is asked if an output is there
// already, and may throw scenes::ImportError for a bad input.
void check_outputs(const std::vector<OutputOption>& outputs, const std::vector<std::string>& inputs,
                   const std::function<std::vector<std::string>(const std::string& input)>& companions = {});

}  // namespace cab::perf
