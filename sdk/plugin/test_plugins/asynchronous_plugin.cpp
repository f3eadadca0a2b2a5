// Backend cpu with queues that work on threads of their own, as a device does: everything but
// signal and wait is only asked for. What a queue was asked for and when it was waited for is
// logged, so that a test sees the order. Pixels that begin with the bytes "refuse" are not taken.
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "plugins/cpu/makers.hpp"

namespace {
using namespace defrec;

const HostPluginDescription kDescription{
    "asynchronous",
    DEFREC_RELEASE,
    "Processor, on queues with threads of their own",
    cpu::kMakers,
};

const defrec_host* host_table = nullptr;
const defrec_plugin* inner = nullptr;  // the same, computing when it is asked
defrec_plugin outer;
defrec_stage_table stages[DEFREC_STAGE_COUNT_V1];

void log(const std::string& text) {
    host_table->log(host_table->self, DEFREC_LOG_DEBUG, text.c_str());
}

class Worker {
  public:
    Worker() : thread_([this] { work(); }) {}
    ~Worker() {
        finish();
        {
            const std::lock_guard lock(mutex_);
            stop_ = true;
        }
        changed_.notify_all();
        thread_.join();
    }
    uint64_t ask(std::function<void()> work) {
        const std::lock_guard lock(mutex_);
        asked_.push_back(std::move(work));
        changed_.notify_all();
        return done_ + asked_.size();
    }
    bool wait(uint64_t count, uint64_t timeout_ns) {
        std::unique_lock lock(mutex_);
        const auto reached = [&] { return done_ >= count; };
        if (timeout_ns == UINT64_MAX) {
            changed_.wait(lock, reached);
            return true;
        }
        return changed_.wait_for(lock, std::chrono::nanoseconds(timeout_ns), reached);
    }
    void finish() {
        wait(ask([] {}), UINT64_MAX);
    }

  private:
    // What is being done stays at the front, so that done and asked for add up to what was ever
    // asked.
    void work() {
        std::unique_lock lock(mutex_);
        for (;;) {
            changed_.wait(lock, [this] { return !asked_.empty() || stop_; });
            if (asked_.empty()) return;
            const auto& next = asked_.front();
            lock.unlock();
            next();
            lock.lock();
            asked_.pop_front();
            ++done_;
            changed_.notify_all();
        }
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::function<void()>> asked_;
    uint64_t done_ = 0;
    bool stop_ = false;
    std::thread thread_;
};

std::mutex workers_mutex;
std::map<defrec_pqueue*, Worker> workers;

Worker& worker_of(defrec_pqueue* queue) {
    const std::lock_guard lock(workers_mutex);
    return workers.at(queue);
}
void finish_all() {
    const std::lock_guard lock(workers_mutex);
    for (auto& [queue, worker] : workers) worker.finish();
}

defrec_status queue_create(defrec_pdevice* device, defrec_pqueue** out) {
    const defrec_status status = inner->queue_create(device, out);
    const std::lock_guard lock(workers_mutex);
    if (status == DEFREC_OK) workers.try_emplace(*out);
    return status;
}
void queue_destroy(defrec_pqueue* queue) {
    {
        const std::lock_guard lock(workers_mutex);
        workers.erase(queue);
    }
    inner->queue_destroy(queue);
}

defrec_status write(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, const void* src,
                    uint64_t size) {
    const auto* bytes = static_cast<const unsigned char*>(src);
    worker_of(queue).ask([=, copy = std::vector<unsigned char>(bytes, bytes + size)] {
        inner->write(queue, buffer, offset, copy.data(), size);
    });
    return DEFREC_OK;
}
defrec_status write_in_place(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                             const void* src, uint64_t size) {
    if (size > 6 && std::memcmp(src, "refuse", 6) == 0) {
        host_table->error(host_table->self, "these pixels are refused");
        return DEFREC_ERROR_PLUGIN;
    }
    worker_of(queue).ask([=] { inner->write(queue, buffer, offset, src, size); });
    return DEFREC_OK;
}
defrec_status read(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, void* dst,
                   uint64_t size) {
    worker_of(queue).ask([=] { inner->read(queue, buffer, offset, dst, size); });
    return DEFREC_OK;
}
defrec_status signal(defrec_pqueue* queue, uint64_t* out_value) {
    *out_value = worker_of(queue).ask([] {});
    return DEFREC_OK;
}
defrec_status wait(defrec_pqueue* queue, uint64_t value, uint64_t timeout_ns) {
    return worker_of(queue).wait(value, timeout_ns) ? DEFREC_OK : DEFREC_TIMEOUT;
}

defrec_status prepare(defrec_pstage* stage, defrec_pqueue* queue, defrec_pbuffer* const* in,
                      size_t in_count) {
    worker_of(queue).finish();
    return inner->stage(inner->self, DEFREC_STAGE_WARP)->prepare(stage, queue, in, in_count);
}
template <size_t kStage>
defrec_status enqueue(defrec_pstage* stage, defrec_pqueue* queue, defrec_pbuffer* const* in,
                      size_t in_count, defrec_pbuffer* const* out, size_t out_count) {
    log("asked for " + std::to_string(kStage));
    const auto run = inner->stage(inner->self, kStage)->enqueue;
    worker_of(queue).ask(
        [=, ins = std::vector(in, in + in_count), outs = std::vector(out, out + out_count)] {
            run(stage, queue, ins.data(), ins.size(), outs.data(), outs.size());
            log("done with " + std::to_string(kStage));
        });
    return DEFREC_OK;
}
template <size_t... kStages>
void wrap_stages(std::index_sequence<kStages...>) {
    ((stages[kStages] = *inner->stage(inner->self, kStages),
      stages[kStages].enqueue = enqueue<kStages>),
     ...);
    for (defrec_stage_table& stage : stages) {
        if (stage.prepare != nullptr) stage.prepare = prepare;
        stage.destroy = [](defrec_pstage* object) {
            finish_all();
            inner->stage(inner->self, 0)->destroy(object);
        };
    }
}

}  // namespace

// One context at a time.
extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    const defrec_status status = enter_host_plugin(kDescription, host, &inner);
    if (status != DEFREC_OK) return status;
    host_table = host;
    outer = *inner;
    outer.queue_create = queue_create;
    outer.queue_destroy = queue_destroy;
    outer.write = write;
    outer.write_in_place = write_in_place;
    outer.read = read;
    outer.signal = signal;
    outer.wait = wait;
    outer.stage = [](void*, uint32_t stage) -> const defrec_stage_table* {
        return stage < DEFREC_STAGE_COUNT_V1 ? &stages[stage] : nullptr;
    };
    outer.buffer_destroy = [](defrec_pbuffer* buffer) {
        finish_all();
        inner->buffer_destroy(buffer);
    };
    wrap_stages(std::make_index_sequence<DEFREC_STAGE_COUNT_V1>());
    *out = &outer;
    return DEFREC_OK;
}
