// A template's file, and two frames that are followed with what it holds. The checksum at its end
// always fits, so that what is behind it is reached.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "sdk/base/util/file_checksum.hpp"
#include "sdk/fuzz/memory_file.hpp"
#include "sdk/fuzz/session.hpp"

using namespace defrec::fuzz;

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace {

defrec_context context() {
    static defrec_context const made = make_context();
    return made;
}

// A good file, which everything begins with.
std::vector<uint8_t> seed() {
    Session session(context());
    defrec_job job = session.track(Pair(0));
    expect_ok(defrec_job_wait(job, UINT64_MAX));
    defrec_template surface = nullptr;
    expect_ok(defrec_job_get_template(job, &surface));
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("defrec-fuzz-" + std::to_string(getpid()));
    expect_ok(defrec_template_save(surface, path.c_str()));
    std::ifstream file(path, std::ios::binary);
    const std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(file)), {});
    std::filesystem::remove(path);
    defrec_template_release(surface);
    defrec_job_release(job);
    return bytes;
}

void follow(Session& session, defrec_template surface) {
    if (defrec_tracker_set_template(session.tracker, surface) != DEFREC_OK) return;
    for (const double dx : {0.5, 1.0}) {
        defrec_job job = session.track(Pair(dx));
        static_cast<void>(defrec_job_wait(job, UINT64_MAX));
        defrec_result result;
        DEFREC_INIT(&result);
        if (defrec_job_result(job, &result) == DEFREC_OK && result.vertex_count > 0) {
            const double uv[2] = {kWidth / 2.0, kHeight / 2.0};
            double xyz[3], moved[3];
            uint8_t found = 0;
            static_cast<void>(defrec_job_lift_points(job, uv, 1, xyz, &found));
            static_cast<void>(defrec_job_warp_points(job, xyz, 1, moved, nullptr, nullptr));
        }
        defrec_job_release(job);
    }
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned) {
    static const std::vector<uint8_t> good = seed();
    constexpr size_t kNoFile = 64;  // whatever is shorter
    if (max_size < kNoFile) return LLVMFuzzerMutate(data, size, max_size);
    if (size < kNoFile) {
        size = std::min(good.size(), max_size);
        std::copy_n(good.begin(), size, data);
    }
    const size_t body =
        LLVMFuzzerMutate(data, size - sizeof(uint64_t), max_size - sizeof(uint64_t));
    const uint64_t sum = defrec::file_checksum(data, body);
    std::memcpy(data + body, &sum, sizeof sum);
    return body + sizeof sum;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static Session session(context());
    const MemoryFile file({data, size});
    defrec_template surface = nullptr;
    if (defrec_template_load(context(), file.path().c_str(), &surface) == DEFREC_OK)
        follow(session, surface);
    defrec_template_release(surface);
    return 0;
}
