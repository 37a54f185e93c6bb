// The run of `cab verify`. It is separate from the command, so that tests can run it on functions with a deliberate
// fault.
#pragma once

#include <ostream>

#include "perf/judge/verify/options.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {

// Runs rounds as the options say, prints the tables and the first violations to `out`, and writes the files. Returns
// the exit code: 1 if there was a violation, else 0.
int verify(const VerifyOptions& options, const Subject& subject, std::ostream& out);

}  // namespace cab::perf
