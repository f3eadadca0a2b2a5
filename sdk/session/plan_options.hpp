// Which plan a run follows, and how often its mesh is written.
#pragma once

#include <cstdint>
#include <string>

namespace defrec::cli {

struct PlanOptions {
    std::string file;             // empty: none
    std::int64_t mesh_every = 1;  // frames from one mesh to the next; 0: none is written
};

}  // namespace defrec::cli
