// What becomes of an application when its GPU has no memory left or fails: the calls say so, the
// process lives, and the processor goes on tracking. A fault spoils CUDA for the process that it
// happens in: each case runs in a child. This process never calls CUDA, which no fork survives.
#include "plugins/cuda/fault.hpp"

#include <cuda_runtime_api.h>
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <optional>

#include "backends/cuda/gpu/test_gpu.hpp"
#include "conformance/cases/stress/stress.hpp"
#include "conformance/worker/failure.hpp"
#include "conformance/worker/plugin.hpp"

using namespace defrec;
using namespace defrec::conformance;

namespace {

constexpr int kSkipped = 5;
constexpr unsigned kTimeLimit = 120;  // s

const RenderedSequence& film() { return rendered_sequence({"heartbeat", 192, 160, 8}); }
constexpr size_t kBefore = 4;  // frames until something happens: no set-up is left to do

// The GPU that the plugin tracks on, or the end of the child.
cuda::GpuInfo gpu_or_skip() {
    std::string why_none;
    if (const auto gpu = test::find_gpu(why_none)) return *gpu;
    std::fprintf(stderr, "skipped: no CUDA device: %s\n", why_none.c_str());
    std::exit(kSkipped);
}

// A tracker that has followed the first frames.
class Session {
  public:
    Session(const std::string& backend, const std::string& device)
        : context_(open_context(find_backend(backend).manifest)),
          device_(device),
          rig_(open_rig(context_.get(), film())),
          tracker_(open_tracker(context_.get(), rig_.get(), device)) {}

    void follow_first() {
        for (size_t i = 0; i < kBefore; ++i)
            require_status(DEFREC_OK, "a frame before anything happened");
    }
    // The next frame, which has to end so.
    void require_status(defrec_status expected, const char* what) {
        defrec_status status = DEFREC_OK;
        const JobHandle job = try_submit(status);
        if (status == DEFREC_OK) status = defrec_job_wait(job.get(), UINT64_MAX);
        require(status == expected, what, " ended with ", defrec_status_name(status), " (",
                defrec_last_error(), "), ", defrec_status_name(expected), " expected");
        if (status < 0) return require_message(what);
        frames_.push_back(result_of(job.get(), {}));
    }
    defrec_status open_another(TrackerHandle& tracker) const {
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.device_id = device_.c_str();
        return defrec_tracker_create(context_.get(), rig_.get(), &desc, tracker.out());
    }
    const std::vector<TrackedFrame>& frames() const { return frames_; }

  private:
    JobHandle try_submit(defrec_status& status) {
        const FilmedFrame& filmed = film().frames[next_];
        const defrec_image left = image_of(film(), filmed.left),
                           right = image_of(film(), filmed.right);
        defrec_frame frame;
        DEFREC_INIT(&frame);
        frame.timestamp_ns = static_cast<int64_t>(++next_) * 40'000'000;
        frame.left = &left;
        frame.right = &right;
        JobHandle job;
        status = defrec_tracker_submit(tracker_.get(), &frame, job.out());
        return job;
    }

    ContextHandle context_;
    std::string device_;
    RigHandle rig_;
    TrackerHandle tracker_;
    size_t next_ = 0;
    std::vector<TrackedFrame> frames_;
};

// Everything that the GPU still has, until it goes.
class AllMemory {
  public:
    explicit AllMemory(int ordinal) {
        cudaSetDevice(ordinal);
        for (size_t size = size_t{1} << 36; size >= 4096; size /= 2) {
            void* memory = nullptr;
            while (cudaMalloc(&memory, size) == cudaSuccess) taken_.push_back(memory);
            cudaGetLastError();
        }
    }
    ~AllMemory() {
        for (void* memory : taken_) cudaFree(memory);
    }
    AllMemory(const AllMemory&) = delete;
    AllMemory& operator=(const AllMemory&) = delete;

  private:
    std::vector<void*> taken_;
};

void without_memory() {
    const cuda::GpuInfo gpu = gpu_or_skip();
    Session session("cuda", gpu.id);
    session.follow_first();
    std::optional<AllMemory> all(gpu.ordinal);
    TrackerHandle another;
    const defrec_status status = session.open_another(another);
    require(status == DEFREC_ERROR_OUT_OF_MEMORY,
            "a tracker on a full GPU: ", defrec_status_name(status), " (", defrec_last_error(),
            ")");
    require_message("defrec_tracker_create");
    session.require_status(DEFREC_OK, "a frame of a tracker that was there before");
    all.reset();
    check_api("defrec_tracker_create on a GPU with memory again", session.open_another(another));
    session.require_status(DEFREC_OK, "another frame");
}

void with_fault(test::Fault fault) {
    const cuda::GpuInfo gpu = gpu_or_skip();
    const Track expected = track({find_backend("cpu").manifest, "cpu"}, film());
    Session first("cuda", gpu.id), second("cuda", gpu.id), processor("cpu", "cpu");
    for (Session* session : {&first, &second, &processor}) session->follow_first();
    require(test::cause(fault, gpu.ordinal), "the fault is none to the device");
    for (Session* session : {&first, &second, &first}) {
        session->require_status(DEFREC_ERROR_DEVICE_LOST, "a frame on a GPU that has failed");
        TrackerHandle another;
        require(session->open_another(another) == DEFREC_ERROR_DEVICE_LOST,
                "a tracker on a GPU that has failed: ", defrec_last_error());
        require_message("defrec_tracker_create");
    }
    while (processor.frames().size() < film().frames.size())
        processor.require_status(DEFREC_OK, "a frame on the processor beside it");
    for (size_t i = 0; i < expected.frames.size(); ++i)
        require(processor.frames()[i].vertices == expected.frames[i].vertices,
                "the processor's frame ", i, " is another beside the failed GPU");
}

// 0, or what the child ended with.
int in_child(void (*body)()) {
    std::fflush(nullptr);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        alarm(kTimeLimit);
        try {
            body();
        } catch (const std::exception& error) {
            std::fprintf(stderr, "%s\n", error.what());
            _exit(1);
        }
        std::exit(0);  // with all that the driver does at the end of a process
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == kSkipped) MESSAGE("skipped: no CUDA device");
    return WIFEXITED(status) && WEXITSTATUS(status) == kSkipped ? 0 : status;
}

}  // namespace

TEST_CASE(
    "a GPU without memory refuses a tracker; those that it has go on, and another fits when there "
    "is room again") {
    CHECK(in_child(without_memory) == 0);
}

TEST_CASE("a kernel that traps loses the GPU for every tracker of the process, and nothing else") {
    CHECK(in_child([] { with_fault(test::Fault::trap); }) == 0);
}

TEST_CASE("a kernel that writes to no memory loses the GPU likewise") {
    CHECK(in_child([] { with_fault(test::Fault::address); }) == 0);
}
