// How are the workers of a coordinator shown?
#pragma once

#include <string>
#include <vector>

#include "proto/lucerna/v1/admin.pb.h"

namespace lucerna {

// A line a worker, below a head: for people. What workers say of themselves is escaped.
[[nodiscard]] std::string WorkersTable(const std::vector<v1::Worker>& workers);
// A JSON array.
[[nodiscard]] std::string WorkersReport(const std::vector<v1::Worker>& workers);

}  // namespace lucerna
