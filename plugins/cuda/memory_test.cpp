// Frames that lie in a GPU's memory, and results that stay there: the same bits as by way of the
// host.
#include <cuda_runtime_api.h>
#include <doctest/doctest.h>

#include <optional>

#include "backends/cuda/gpu/test_gpu.hpp"
#include "conformance/cases/stress/stress.hpp"
#include "conformance/worker/plugin.hpp"

using namespace defrec;
using namespace defrec::conformance;

namespace {

constexpr size_t kRing = 2;  // pairs of images that a producer would use in turn
constexpr uint8_t kUntouched = 0xEE;

const RenderedSequence& film() { return rendered_sequence({"heartbeat", 192, 160, 6}); }

void require_cuda(cudaError_t error) {
    REQUIRE_MESSAGE(error == cudaSuccess, cudaGetErrorString(error));
}

// Memory of the GPU that a tracker knows.
class Imported {
  public:
    Imported(defrec_tracker tracker, size_t size) {
        require_cuda(cudaMalloc(&address_, size));
        require_cuda(cudaMemset(address_, kUntouched, size));
        defrec_memory_desc desc;
        DEFREC_INIT(&desc);
        desc.kind = DEFREC_MEMORY_CUDA;
        desc.address = address_;
        desc.size = size;
        check_api("defrec_memory_import", defrec_memory_import(tracker, &desc, &memory_));
    }
    ~Imported() {
        defrec_memory_release(memory_);
        cudaFree(address_);
    }
    Imported(const Imported&) = delete;
    Imported& operator=(const Imported&) = delete;
    void* address() const { return address_; }
    defrec_memory get() const { return memory_; }

  private:
    void* address_ = nullptr;
    defrec_memory memory_ = nullptr;
};

// Has the image lie there, with its rows `pitch` apart.
void move_to(const Imported& memory, size_t pitch, defrec_image& image) {
    const size_t row = 3 * size_t{film().request.width};
    require_cuda(cudaMemcpy2D(memory.address(), pitch, image.pixels, row, row,
                              film().request.height, cudaMemcpyHostToDevice));
    image.pixels = nullptr;
    image.stride = pitch;
    image.memory = memory.get();
}

// The surface left in memory has the result's vertices, and nothing is written beyond it.
void check_surface(const Imported& surface, const TrackedFrame& found) {
    const size_t count = found.vertices.size() / 3;
    REQUIRE(count > 0);
    std::vector<defrec_surface_sample> left(count + 1);
    require_cuda(cudaMemcpy(left.data(), surface.address(), left.size() * sizeof left[0],
                            cudaMemcpyDeviceToHost));
    bool same = true;
    for (size_t vertex = 0; vertex < count; ++vertex)
        same &= std::equal(left[vertex].position, left[vertex].position + 3,
                           &found.vertices[3 * vertex]);
    CHECK(same);
    const auto* beyond = reinterpret_cast<const uint8_t*>(&left[count]);
    CHECK(std::all_of(beyond, beyond + sizeof left[0],
                      [](uint8_t byte) { return byte == kUntouched; }));
}

}  // namespace

TEST_CASE(
    "frames in a GPU's memory give the bits of copied ones, and the surface is left there as the "
    "result has it") {
    std::string why_none;
    const std::optional<cuda::GpuInfo> gpu = test::find_gpu(why_none);
    if (!gpu) {
        MESSAGE("skipped: no CUDA device: ", why_none);
        return;
    }
    require_cuda(cudaSetDevice(gpu->ordinal));
    const std::string manifest = find_backend("cuda").manifest;
    const Track expected = track({manifest, gpu->id}, film());

    const uint32_t width = film().request.width, height = film().request.height;
    const size_t pitch = 3 * size_t{width} + 64;
    const ContextHandle context = open_context(manifest);
    const RigHandle rig = open_rig(context.get(), film());
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    desc.device_id = gpu->id.c_str();
    desc.seed = 1;
    desc.memory_stride = static_cast<uint32_t>(pitch);
    // Several lives of everything: what comes later gets the addresses of what was freed.
    for (int life = 0; life < 3; ++life) {
        TrackerHandle tracker;
        check_api("defrec_tracker_create",
                  defrec_tracker_create(context.get(), rig.get(), &desc, tracker.out()));
        std::optional<Imported> views[kRing][2], surface;
        surface.emplace(tracker.get(), size_t{width} * height * sizeof(defrec_surface_sample));
        for (size_t i = 0; i < film().frames.size(); ++i) {
            CAPTURE(life);
            CAPTURE(i);
            auto& pair = views[i % kRing];
            const FilmedFrame& filmed = film().frames[i];
            defrec_image images[2] = {image_of(film(), filmed.left),
                                      image_of(film(), filmed.right)};
            for (size_t view = 0; view < 2; ++view) {
                if (i == kRing + 1) pair[view].reset();  // a producer that makes its ring anew
                if (!pair[view]) pair[view].emplace(tracker.get(), pitch * height);
                move_to(*pair[view], pitch, images[view]);
            }
            defrec_frame frame;
            DEFREC_INIT(&frame);
            frame.timestamp_ns = static_cast<int64_t>(i + 1) * 40'000'000;
            frame.left = &images[0];
            frame.right = &images[1];
            frame.samples = surface->get();
            JobHandle job;
            check_api("defrec_tracker_submit",
                      defrec_tracker_submit(tracker.get(), &frame, job.out()));
            check_api("defrec_job_wait", defrec_job_wait(job.get(), UINT64_MAX));
            const TrackedFrame found = result_of(job.get(), {});
            CHECK(found.state == expected.frames[i].state);
            CHECK((found.vertices == expected.frames[i].vertices));
            CHECK((found.expected_error == expected.frames[i].expected_error));
            check_surface(*surface, found);
        }
    }
}
