// See stage_runner.hpp.
#include "sdk/device/stage_runner.hpp"

#include <algorithm>
#include <vector>

#include "backends/stages/list.hpp"
#include "sdk/base/os/run_within.hpp"

namespace defrec {
namespace {

// Takes both kinds of the C API's buffers. needed(i): bytes that buffer i must have.
template <class Buffer, class Needed>
void check_buffers(const char* what, const Buffer* buffers, size_t count, Needed needed) {
    if (count > kMaxStageBuffers)
        fail(DEFREC_ERROR_ARGUMENT, what, ": ", count, " buffers given, at most ", kMaxStageBuffers,
             " expected");
    if (buffers == nullptr && count != 0)
        fail(DEFREC_ERROR_ARGUMENT, what, " is NULL with a count of ", count);
    for (size_t i = 0; i < count; ++i) {
        if (buffers[i].data == nullptr) {
            if (buffers[i].size != 0)
                fail(DEFREC_ERROR_ARGUMENT, what, "[", i, "].data is NULL with a size of ",
                     buffers[i].size);
        } else if (buffers[i].size < needed(i)) {
            fail(DEFREC_ERROR_ARGUMENT, what, "[", i, "] has ", buffers[i].size, " bytes, ",
                 needed(i), " are needed");
        } else if (buffers[i].size > PTRDIFF_MAX) {
            fail(DEFREC_ERROR_ARGUMENT, what, "[", i, "].size is ", buffers[i].size,
                 ", more than any memory has");
        }
    }
}

// Bytes of the caller, who may take them back while the plugin is still at them; no data: a buffer
// that is not given.
struct Bytes {
    Bytes(const void* data, uint64_t size)
        : is_given(data != nullptr),
          bytes(static_cast<const unsigned char*>(data),
                static_cast<const unsigned char*>(data) + (data != nullptr ? size : 0)) {}
    bool is_given;
    std::vector<unsigned char> bytes;
};
using BytesList = std::vector<Bytes>;

template <class Buffer>
BytesList copy_of(const Buffer* buffers, size_t count) {
    BytesList list;
    for (size_t i = 0; i < count; ++i) list.emplace_back(buffers[i].data, buffers[i].size);
    return list;
}

}  // namespace

// What the plugin's thread works on.
class StageRunner::Work {
  public:
    Work(std::shared_ptr<const Device> device, const StageParams& params)
        : device_(std::move(device)),
          queue_(device_),
          stage_(device_, params.stage(), params.get()),
          needs_prepare_(device_->stage_table(params.stage())->prepare != nullptr) {}

    bool needs_prepare() const { return needs_prepare_; }

    void prepare(const BytesList& in) {
        upload(prepared_, in);
        stage_.prepare(queue_, given(prepared_, in.size()));
        queue_.finish();
    }

    void run(const BytesList& in, BytesList& out) {
        upload(in_, in);
        // Up as well, so that bytes which the stage leaves alone come back as they were.
        upload(out_, out);
        stage_.enqueue(queue_, given(in_, in.size()), given(out_, out.size()));
        queue_.finish();
        for (size_t i = 0; i < out.size(); ++i)
            if (!out[i].bytes.empty())
                queue_.read(out_[i], out[i].bytes.data(), out[i].bytes.size());
        queue_.finish();
    }

  private:
    using Buffers = std::vector<DeviceBuffer>;

    // The device's buffers have the caller's sizes exactly: some stages count their records by
    // them.
    void upload(Buffers& buffers, const BytesList& from) {
        buffers.resize(std::max(buffers.size(), from.size()));
        for (size_t i = 0; i < from.size(); ++i) {
            DeviceBuffer& buffer = buffers[i];
            const std::vector<unsigned char>& bytes = from[i].bytes;
            if (!from[i].is_given) {
                buffer = DeviceBuffer();
                continue;
            }
            if (buffer.size() != bytes.size() || !buffer)
                buffer = DeviceBuffer(device_, bytes.size());
            if (!bytes.empty()) queue_.write(buffer, bytes.data(), bytes.size());
        }
    }
    static std::vector<const DeviceBuffer*> given(const Buffers& buffers, size_t count) {
        std::vector<const DeviceBuffer*> pointers(count);
        for (size_t i = 0; i < count; ++i) pointers[i] = buffers[i] ? &buffers[i] : nullptr;
        return pointers;
    }

    std::shared_ptr<const Device> device_;
    Queue queue_;
    DeviceStage stage_;
    Buffers prepared_, in_, out_;
    const bool needs_prepare_;
};

template <class Body>
void StageRunner::within_deadline(const char* call, Body&& body) const {
    if (device_.is_quarantined())
        fail(DEFREC_ERROR_DEVICE_LOST, device_.description().id, ": ", call,
             ": the device is quarantined, because it did not answer before");
    if (!run_within(device_.services()->plugin_deadline(), std::forward<Body>(body)))
        throw device_.give_up(call);
}

StageRunner::StageRunner(const DeviceChoice& device, const StageParams& params)
    : device_(device), params_(params) {
    const auto made = std::make_shared<std::shared_ptr<Work>>();
    within_deadline("creating a stage", [=, choice = device_, given = params_] {
        *made = std::make_shared<Work>(choice.open(), given);
    });
    work_ = std::move(*made);
    needs_prepare_ = work_->needs_prepare();
}

void StageRunner::prepare(const defrec_const_buffer* in, size_t in_count) {
    check_buffers("in", in, in_count, [](size_t) { return uint64_t{0}; });
    within_deadline("preparing a stage",
                    [work = work_, inputs = copy_of(in, in_count)] { work->prepare(inputs); });
    needs_prepare_ = false;
}

void StageRunner::run(const defrec_const_buffer* in, size_t in_count, const defrec_buffer* out,
                      size_t out_count) {
    if (needs_prepare_)
        fail(DEFREC_ERROR_STATE, "the stage ", stage_name(params_.stage()),
             " needs defrec_stage_prepare before its first run");
    check_buffers("in", in, in_count, [this](size_t i) { return params_.input_bytes(i); });
    check_buffers("out", out, out_count, [this](size_t i) { return params_.output_bytes(i); });
    const auto results = std::make_shared<BytesList>(copy_of(out, out_count));
    within_deadline("running a stage", [work = work_, inputs = copy_of(in, in_count), results] {
        work->run(inputs, *results);
    });
    for (size_t i = 0; i < out_count; ++i)
        std::copy((*results)[i].bytes.begin(), (*results)[i].bytes.end(),
                  static_cast<unsigned char*>(out[i].data));
}

}  // namespace defrec
