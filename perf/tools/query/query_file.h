// Queries from CSV files.
#pragma once

#include <cab/query.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cab::perf {

// The most queries that files and --random may give together. They take half a gigabyte.
inline constexpr std::size_t kMaxQueries = std::size_t{1} << 22;

// The most bytes of a line of a query file.
inline constexpr std::size_t kMaxQueryLine = 1024;

// The kinds that files have, in the order in which their queries are asked.
inline constexpr QueryKind kFileKinds[] = {QueryKind::kRay, QueryKind::kSphere, QueryKind::kBox, QueryKind::kCapsule,
                                           QueryKind::kPoint};
inline constexpr std::size_t kFileKindCount = 5;

// The plural of a kind of kFileKinds, such as "rays".
const char* kind_name(QueryKind kind);

// The columns of a kind's files, such as "x y z radius"; those that may be left out are in brackets.
std::string column_names(QueryKind kind);

// Reads the text of a file: a line that names the columns in any order, then a line of numbers per query, separated by
// commas, semicolons or blanks. Empty lines and lines that begin with # are passed over. The file may begin with a byte
// order mark, and lines may end with CR LF. Other members of the queries have their defaults. `name` is how messages
// name the file. Throws ImportError, which names the file, and the line and the column if they are known, if anything
// is wrong, or if there are no queries or more than `most`.
std::vector<Query> parse_queries(QueryKind kind, std::string_view text, const std::string& name, std::size_t most);

// The same of a file, which must be regular and at most as large as those of the import.
std::vector<Query> read_queries(QueryKind kind, const std::string& path, std::size_t most);

}  // namespace cab::perf
