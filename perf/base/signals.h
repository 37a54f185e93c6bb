// What a signal that ends the command leaves behind: no file beside its place, and no line of progress.
#pragma once

#include <string>

namespace cab::perf {

// To be called once, at the start of the command. A signal that ends it then first removes the files and the line
// below. Signals that the caller ignores, as `nohup` does, stay ignored. A write beyond the limit of a file's size
// fails with the system's reason, as other writes do.
void clean_up_at_signals();

// A file that such a signal removes; there may be any number. The text must stay until keep_at_signals.
void remove_at_signals(const std::string& path);
void keep_at_signals(const std::string& path);

// Whether standard error ends in a line that such a signal clears.
void clear_line_at_signals(bool is_shown);

}  // namespace cab::perf
