// A device has another id each time one asks.
#include <cstddef>
#include <list>
#include <mutex>
#include <string>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.plugin.device_info = [](void* self, size_t index, defrec_device_info* out) {
        static std::mutex mutex;
        static std::list<std::string> ids;
        const std::lock_guard lock(mutex);
        const defrec_status status = good.plugin.device_info(self, index, out);
        if (status == DEFREC_OK && out->struct_size >= offsetof(defrec_device_info, name))
            out->id = ids.emplace_back("device:" + std::to_string(ids.size())).c_str();
        return status;
    };
}};
}  // namespace defrec::faulty
