#include <doctest/doctest.h>

#include <set>

#include "backends/cuda/gpu/gpu.hpp"

using namespace defrec;

TEST_CASE(
    "the machine's GPUs have ids of their own, the same each time; where there is none, there is a "
    "reason") {
    std::string why_none;
    const std::vector<cuda::GpuInfo> gpus = cuda::list_gpus(why_none),
                                     again = cuda::list_gpus(why_none);
    CHECK(gpus.empty() != why_none.empty());
    if (gpus.empty()) MESSAGE("skipped: no CUDA device: ", why_none);
    std::set<std::string> ids;
    REQUIRE(again.size() == gpus.size());
    for (size_t i = 0; i < gpus.size(); ++i) {
        CHECK(gpus[i].broken == again[i].broken);
        if (!gpus[i].broken.empty()) continue;
        CHECK(gpus[i].id.size() ==
              std::string("cuda:GPU-01234567-89ab-cdef-0123-456789abcdef").size());
        CHECK(gpus[i].id.find("cuda:GPU-") == 0);
        CHECK(ids.insert(gpus[i].id).second);
        CHECK(gpus[i].id == again[i].id);
        CHECK(!gpus[i].name.empty());
        CHECK(gpus[i].memory_bytes > 0);
    }
}
