// A plan's file, and its points in a frame. The template's fingerprint and the checksum always fit,
// so that what is behind them is reached.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "sdk/base/util/file_checksum.hpp"
#include "sdk/fuzz/memory_file.hpp"
#include "sdk/fuzz/session.hpp"

using namespace defrec::fuzz;

namespace {

using Bytes = std::vector<uint8_t>;

void require(bool is_true) {
    if (!is_true) std::abort();
}

// A plan's file as the library writes it.
Bytes saved(defrec_plan plan) {
    static const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("defrec-fuzz-" + std::to_string(getpid()));
    expect_ok(defrec_plan_save(plan, path.c_str()));
    std::ifstream file(path, std::ios::binary);
    Bytes bytes((std::istreambuf_iterator<char>(file)), {});
    std::filesystem::remove(path);
    return bytes;
}

// A frame that is followed, its template, and a plan of this without points.
struct Scene {
    Session session;
    defrec_job job = nullptr;
    defrec_template surface = nullptr;
    Bytes empty_plan;

    explicit Scene(defrec_context context) : session(context) {
        defrec_job first = session.track(Pair(0));
        expect_ok(defrec_job_wait(first, UINT64_MAX));
        expect_ok(defrec_job_get_template(first, &surface));
        defrec_job_release(first);
        job = session.track(Pair(0.5));
        expect_ok(defrec_job_wait(job, UINT64_MAX));
        empty_plan = saved_empty_plan();
    }
    ~Scene() {
        defrec_template_release(surface);
        defrec_job_release(job);
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

  private:
    Bytes saved_empty_plan() const {
        const double places[] = {0, 0, 80, 20, 0, 80, 0, 20, 80, 5, 5, 100};
        defrec_registration_pairs pairs;
        DEFREC_INIT(&pairs);
        pairs.model_xyz = pairs.seen_xyz = places;
        pairs.count = 4;
        defrec_registration registration = nullptr;
        expect_ok(defrec_registration_from_pairs(&pairs, &registration));
        defrec_plan_desc desc;
        DEFREC_INIT(&desc);
        desc.flags = DEFREC_PLAN_LOOKED_AT;
        defrec_plan plan = nullptr;
        expect_ok(defrec_plan_create(surface, registration, &desc, &plan));
        defrec_registration_destroy(registration);
        Bytes bytes = saved(plan);
        defrec_plan_destroy(plan);
        return bytes;
    }
};

// With the fingerprint behind kind and layout, whose length is before it, and the checksum.
Bytes mended(const uint8_t* data, size_t size, const Bytes& good) {
    constexpr size_t kFrom = 12, kTo = kFrom + sizeof(uint64_t) + 64;
    Bytes bytes(data, data + size);
    if (size < kTo + sizeof(uint64_t)) return bytes;
    std::copy(good.begin() + kFrom, good.begin() + kTo, bytes.begin() + kFrom);
    const size_t body = size - sizeof(uint64_t);
    const uint64_t sum = defrec::file_checksum(bytes.data(), body);
    std::memcpy(bytes.data() + body, &sum, sizeof sum);
    return bytes;
}

void check(const defrec_plan_info& info) {
    require(info.point_count == info.vertex_count + info.target_count);
    for (uint64_t i = 0; i < 3 * info.triangle_count; ++i)
        require(info.triangles[i] < info.vertex_count);
    for (uint64_t i = 0; i < info.part_count; ++i) {
        const defrec_plan_part& part = info.parts[i];
        require(std::strlen(part.name) > 0 && part.first_triangle <= info.triangle_count &&
                part.triangle_count <= info.triangle_count - part.first_triangle);
    }
    for (uint64_t i = 0; i < info.target_count; ++i)
        require(std::strlen(info.target_names[i]) <= 255);
    for (uint64_t i = 0; i < info.point_count; ++i) {
        require(info.registration_error_mm[i] >= 0);
        for (uint64_t k = 0; k < 3; ++k) require(std::isfinite(info.template_xyz[3 * i + k]));
    }
}

void follow(defrec_job job, defrec_plan plan, size_t count) {
    std::vector<double> xyz(3 * count), covariance(6 * count), errors(count);
    std::vector<uint8_t> status(count);
    expect_ok(defrec_job_move_plan(job, plan, count, xyz.data(), covariance.data(), status.data(),
                                   errors.data()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Scene scene(make_context());
    const Bytes bytes = mended(data, size, scene.empty_plan);
    const MemoryFile file(bytes);
    defrec_plan plan = nullptr;
    if (defrec_plan_load(scene.surface, file.path().c_str(), &plan) != DEFREC_OK) return 0;
    defrec_plan_info info;
    DEFREC_INIT(&info);
    expect_ok(defrec_plan_get(plan, &info));
    check(info);
    follow(scene.job, plan, info.point_count);
    require(saved(plan) == bytes);
    defrec_plan_destroy(plan);
    return 0;
}
