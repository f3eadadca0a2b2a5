// See device.hpp.
#include "sdk/device/device.hpp"

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>

#include "backends/stages/list.hpp"
#include "sdk/base/os/run_within.hpp"
#include "sdk/plugin/host.hpp"
#include "sdk/plugin/loader.hpp"

namespace defrec {

namespace {
#define DEFREC_NAME(name, NAME) "support for " #name
constexpr const char* kSupportNames[] = {DEFREC_STAGES(DEFREC_NAME, DEFREC_COMMA)};
#undef DEFREC_NAME
#define DEFREC_NAME(name, NAME) "creating " #name
constexpr const char* kCreateNames[] = {DEFREC_STAGES(DEFREC_NAME, DEFREC_COMMA)};
#undef DEFREC_NAME
}  // namespace

Device::Device(std::shared_ptr<const LoadedPlugin> plugin, size_t index,
               std::shared_ptr<DeviceWatch> watch)
    : plugin_(std::move(plugin)),
      index_(index),
      table_(&plugin_->table()),
      watch_(std::move(watch)),
      id_(plugin_->devices()[index].id),
      stages_(plugin_->devices()[index].stages) {
    defrec_pdevice* opened = nullptr;
    call("device_open", table_->device_open, table_->self, plugin_->devices()[index].index,
         &opened);
    if (opened == nullptr)
        fail(DEFREC_ERROR_PLUGIN, id_, ": device_open succeeded without a device");
    device_ = opened;
}

Device::~Device() {
    if (device_ != nullptr) release("device_close", table_->device_close, device_);
}

const defrec_stage_table* Device::stage_table(uint32_t stage) const {
    return stage < 32 && (stages_ >> stage & 1) != 0 ? plugin_->stage_table(stage) : nullptr;
}

const Services& Device::services() const { return *plugin_->services(); }

bool Device::has_host_memory() const { return DEFREC_HAS(table_, host_alloc); }

bool Device::copies_at_once() const {
    return !has_host_memory() && !DEFREC_HAS(table_, write_in_place);
}

void Device::begin_call(const char* what) const {
    if (lost_ || plugin_->is_quarantined(index_))
        fail(DEFREC_ERROR_DEVICE_LOST, id_, ": ", what, ": the device was lost before");
    clear_plugin_error();
    Services::forget_parallel_failure();
}

defrec_status Device::end_call(const char* what, defrec_status status) const {
    Services::expect_parallel_success(what);
    if (status >= 0) return status;
    if (status == DEFREC_ERROR_DEVICE_LOST) lost_ = true;
    fail(status, id_, ": ", what, ": ", plugin_error_or_name(status));
}

void Device::refuse_exception(const char* what) const {
    keep_thread(what);
    fail(DEFREC_ERROR_PLUGIN, id_, ": ", what, " threw an exception");
}

void Device::refuse_unanswered(const char* what) const {
    lost_ = true;
    plugin_->quarantine(index_, what);
    fail(DEFREC_ERROR_DEVICE_LOST, id_, ": ", what, ": no answer within ", deadline().count(),
         " ms; the device is quarantined");
}

std::chrono::milliseconds Device::deadline() const { return services().plugin_deadline(); }

void Device::log_exception(const char* what) const noexcept {
    keep_thread(what);
    log(DEFREC_LOG_ERROR, what, " threw an exception");
}

void Device::log(int32_t level, const char* what, const char* happened) const noexcept {
    try {
        services().log(level, "sdk", concat(id_, ": ", what, happened).c_str());
    } catch (const std::bad_alloc&) {
        // Without memory nothing is logged.
    }
}

void Device::keep_thread(const char* what) const noexcept {
    if (std::current_exception() != nullptr) return;
    // The device has not answered.
    if (watch_ != nullptr) watch_->enter(what);
    log(DEFREC_LOG_ERROR, what, " ended the thread that called it");
    stay_if_thread_ends();
}

void Device::tell_changed_mode(const char* what) const noexcept {
    if (has_told_mode_.exchange(true)) return;
    log(DEFREC_LOG_WARNING, what, " changed the floating point mode; it was set back");
}

DeviceBuffer::DeviceBuffer(std::shared_ptr<const Device> device, uint64_t size)
    : device_(std::move(device)), size_(size) {
    const defrec_plugin& table = device_->table();
    device_->call("buffer_create", table.buffer_create, device_->get(), std::max<uint64_t>(size, 1),
                  &buffer_);
    if (buffer_ == nullptr)
        fail(DEFREC_ERROR_PLUGIN, device_->id(), ": buffer_create succeeded without a buffer");
}

DeviceBuffer DeviceBuffer::import(std::shared_ptr<const Device> device, uint32_t kind, void* memory,
                                  uint64_t size) {
    const defrec_plugin& table = device->table();
    if (!DEFREC_HAS(&table, buffer_import))
        fail(DEFREC_ERROR_UNSUPPORTED, "device ", device->id(),
             " does not take the application's memory as it is");
    DeviceBuffer buffer;
    device->call("buffer_import", table.buffer_import, device->get(), kind, memory, size,
                 &buffer.buffer_);
    if (buffer.buffer_ == nullptr)
        fail(DEFREC_ERROR_PLUGIN, device->id(), ": buffer_import succeeded without a buffer");
    buffer.device_ = std::move(device);
    buffer.size_ = size;
    return buffer;
}

DeviceBuffer::~DeviceBuffer() {
    if (buffer_ != nullptr)
        device_->release("buffer_destroy", device_->table().buffer_destroy, buffer_);
}

HostMemory::HostMemory(std::shared_ptr<const Device> device, uint64_t size)
    : device_(std::move(device)), size_(size) {
    if (size == 0) return;
    if (device_->has_host_memory()) {
        device_->call("host_alloc", device_->table().host_alloc, device_->get(), size, &memory_);
        if (memory_ == nullptr)
            fail(DEFREC_ERROR_PLUGIN, device_->id(), ": host_alloc succeeded without memory");
    } else {
        memory_ = device_->services().allocate(size, 64);
        if (memory_ == nullptr) throw std::bad_alloc();
        std::memset(memory_, 0, size);
    }
}

HostMemory::~HostMemory() {
    if (memory_ == nullptr) return;
    if (device_->has_host_memory())
        device_->release("host_free", device_->table().host_free, device_->get(), memory_);
    else
        device_->services().release(memory_);
}

DeviceBuffer HostMemory::as_buffer() const {
    if (memory_ == nullptr || !device_->copies_at_once()) return {};
    try {
        return DeviceBuffer::import(device_, DEFREC_MEMORY_HOST, memory_, size_);
    } catch (const Error& error) {
        if (error.status() != DEFREC_ERROR_UNSUPPORTED) throw;
        return {};
    }
}

Queue::Queue(std::shared_ptr<const Device> device) : device_(std::move(device)) {
    device_->call("queue_create", device_->table().queue_create, device_->get(), &queue_);
    if (queue_ == nullptr)
        fail(DEFREC_ERROR_PLUGIN, device_->id(), ": queue_create succeeded without a queue");
}

Queue::~Queue() {
    if (queue_ != nullptr)
        device_->release("queue_destroy", device_->table().queue_destroy, queue_);
}

namespace {
void check_range(const char* what, const DeviceBuffer& buffer, uint64_t offset, uint64_t size) {
    if (offset > buffer.size() || size > buffer.size() - offset)
        fail(DEFREC_ERROR_INTERNAL, what, " of ", size, " bytes at ", offset,
             " does not lie in a buffer of ", buffer.size());
}
}  // namespace

void Queue::write(const DeviceBuffer& buffer, const void* src, uint64_t size, uint64_t offset) {
    check_range("write", buffer, offset, size);
    device_->call("write", device_->table().write, queue_, buffer.get(), offset, src, size);
}

void Queue::write_in_place(const DeviceBuffer& buffer, const void* src, uint64_t size,
                           uint64_t offset) {
    const defrec_plugin& table = device_->table();
    if (!DEFREC_HAS(&table, write_in_place)) return write(buffer, src, size, offset);
    check_range("write", buffer, offset, size);
    device_->call("write_in_place", table.write_in_place, queue_, buffer.get(), offset, src, size);
}

void Queue::read(const DeviceBuffer& buffer, void* dst, uint64_t size, uint64_t offset) {
    check_range("read", buffer, offset, size);
    device_->call("read", device_->table().read, queue_, buffer.get(), offset, dst, size);
}

uint64_t Queue::signal() {
    uint64_t value = 0;
    device_->call("signal", device_->table().signal, queue_, &value);
    return value;
}

bool Queue::wait(uint64_t value, uint64_t timeout_ns) {
    return device_->call("wait", device_->table().wait, queue_, value, timeout_ns) !=
           DEFREC_TIMEOUT;
}

void Queue::finish() { wait(signal()); }

// In parts, so that a device which answers, but does not finish, is told from one that does not.
void Queue::wait(uint64_t value) {
    using Clock = std::chrono::steady_clock;
    constexpr int kParts = 4;
    const std::chrono::nanoseconds part = std::chrono::nanoseconds(device_->deadline()) / kParts;
    for (int i = 0; i < kParts; ++i) {
        const Clock::time_point begin = Clock::now();
        if (wait(value, static_cast<uint64_t>(part.count()))) return;
        if (Clock::now() - begin < part / 2)
            fail(DEFREC_ERROR_PLUGIN, device_->id(), ": a wait ended before its time and the work");
    }
    device_->refuse_unanswered("waiting for its work");
}

DeviceStage::DeviceStage(std::shared_ptr<const Device> device, uint32_t stage, const void* params)
    : device_(std::move(device)), table_(device_->stage_table(stage)) {
    if (table_ == nullptr)
        fail(DEFREC_ERROR_UNSUPPORTED, "device ", device_->id(), " does not offer the stage ",
             stage_name(stage));
    device_->call(kSupportNames[stage], table_->supports, device_->get(), params);
    device_->call(kCreateNames[stage], table_->create, device_->get(), params, &stage_);
    if (stage_ == nullptr)
        fail(DEFREC_ERROR_PLUGIN, device_->id(), ": ", kCreateNames[stage],
             " succeeded without a stage");
}

DeviceStage::~DeviceStage() {
    if (stage_ != nullptr) device_->release(stage_name(table_->stage), table_->destroy, stage_);
}

size_t DeviceStage::collect(BufferSpan buffers, Pointers& out) {
    if (buffers.size() > out.size())
        fail(DEFREC_ERROR_ARGUMENT, buffers.size(), " buffers given, at most ", out.size(),
             " expected");
    for (size_t i = 0; i < buffers.size(); ++i)
        out[i] = buffers[i] == nullptr ? nullptr : buffers[i]->get();
    return buffers.size();
}

void DeviceStage::prepare(Queue& queue, BufferSpan in) {
    if (table_->prepare == nullptr)
        fail(DEFREC_ERROR_ARGUMENT, "the stage ", stage_name(table_->stage),
             " has nothing to prepare");
    Pointers inputs;
    const size_t in_count = collect(in, inputs);
    device_->call(stage_name(table_->stage), table_->prepare, stage_, queue.get(), inputs.data(),
                  in_count);
}

void DeviceStage::enqueue(Queue& queue, BufferSpan in, BufferSpan out) {
    Pointers inputs, outputs;
    const size_t in_count = collect(in, inputs), out_count = collect(out, outputs);
    device_->call(stage_name(table_->stage), table_->enqueue, stage_, queue.get(), inputs.data(),
                  in_count, outputs.data(), out_count);
}

}  // namespace defrec
