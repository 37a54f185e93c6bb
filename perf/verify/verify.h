// The run behind `cab verify`, apart from the command so that tests can put something broken in the library's place.
#pragma once

#include <ostream>

#include "perf/verify/options.h"
#include "perf/verify/parts.h"

namespace cab::perf {

// Runs rounds as the options say, prints the tables and the first violations to out, writes the files. The exit code: 1
// where there was a violation.
int verify(const VerifyOptions& options, const Subject& subject, std::ostream& out);

}  // namespace cab::perf
