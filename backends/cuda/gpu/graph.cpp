// See graph.hpp.
#include "backends/cuda/gpu/graph.hpp"

#include <algorithm>
#include <functional>

#include "backends/cuda/gpu/check.hpp"
#include "backends/cuda/gpu/graph_kernels.hpp"

namespace defrec::cuda {
namespace {

constexpr size_t kSharedOfAll = 48 * 1024;
// Bytes up to which a kernel copies instead of the device's copy engines, which take several
// microseconds more to begin and to end. Reading the host's memory a kernel is slower than they
// are, and one that copies much takes multiprocessors from other trackers.
constexpr uint64_t kMaxReadByKernel = 64 * 1024, kMaxWrittenByKernel = 512 * 1024;

using Nodes = std::vector<cudaGraphNode_t>;

// CUDA takes no node twice.
void add_new(Nodes& nodes, const Nodes& others) {
    for (const cudaGraphNode_t node : others)
        if (std::find(nodes.begin(), nodes.end(), node) == nodes.end()) nodes.push_back(node);
}

class Builder {
  public:
    explicit Builder(const Limits& limits) : limits_(limits) {
        check(cudaGraphCreate(&graph_, 0), "cudaGraphCreate");
    }
    ~Builder() { cudaGraphDestroy(graph_); }
    Builder(const Builder&) = delete;
    Builder& operator=(const Builder&) = delete;
    cudaGraph_t graph() const { return graph_; }

    // The nodes that an early node of the operation has to wait for.
    using EarlyNodes = std::function<Nodes(const Node&)>;

    // These give the nodes that later ones have to wait for.
    Nodes add(const Operation& operation, const Nodes& after, const EarlyNodes& early) {
        if (const auto* run = std::get_if<std::shared_ptr<const StageRun>>(&operation))
            return add((*run)->recording, after, early);
        if (const auto* upload = std::get_if<Upload>(&operation))
            return {
                add_copy(upload->to, upload->from, upload->size, cudaMemcpyHostToDevice, after)};
        const auto& download = std::get<Download>(operation);
        return {add_copy(download.to, download.from, download.size, cudaMemcpyDeviceToHost, after)};
    }
    cudaGraphNode_t add(const KernelCall& call, const Nodes& after) {
        allow_shared(call.function, call.grid.shared, limits_);
        cudaKernelNodeParams parameters{};
        parameters.func = const_cast<void*>(call.function);
        parameters.gridDim = call.grid.blocks;
        parameters.blockDim = call.grid.threads;
        parameters.sharedMemBytes = static_cast<unsigned>(call.grid.shared);
        parameters.kernelParams = const_cast<void**>(call.arguments.data());
        cudaGraphNode_t node = nullptr;
        check(cudaGraphAddKernelNode(&node, graph_, after.data(), after.size(), &parameters),
              "cudaGraphAddKernelNode");
        if (call.grid.cooperative) {
            cudaKernelNodeAttrValue value{};
            value.cooperative = 1;
            check(cudaGraphKernelNodeSetAttribute(node, cudaLaunchAttributeCooperative, &value),
                  "cudaGraphKernelNodeSetAttribute");
        }
        if (call.grid.cluster) {
            allow_cluster(call.function);
            cudaKernelNodeAttrValue value{};
            value.clusterDim = {call.grid.blocks.x, call.grid.blocks.y, call.grid.blocks.z};
            check(
                cudaGraphKernelNodeSetAttribute(node, cudaLaunchAttributeClusterDimension, &value),
                "cudaGraphKernelNodeSetAttribute");
        }
        return node;
    }

  private:
    Nodes add(const Recording& recording, const Nodes& after, const EarlyNodes& early) {
        Nodes nodes;
        for (const Node& node : recording.nodes) {
            Nodes before;
            for (const uint32_t index : node.after) before.push_back(nodes[index]);
            if (node.first) add_new(before, node.early.empty() ? after : early(node));
            nodes.push_back(add(node, before));
        }
        Nodes last;
        for (const uint32_t index : recording.last) last.push_back(nodes[index]);
        return last;
    }
    cudaGraphNode_t add(const Node& node, const Nodes& after) {
        if (const auto* call = std::get_if<KernelCall>(&node.work)) return add(*call, after);
        // Not a node of its own kind, which initcheck does not know.
        if (const auto* fill = std::get_if<Fill>(&node.work)) return add(fill_call(*fill), after);
        const auto& copy = std::get<Copy>(node.work);
        return add_copy(copy.to, copy.from, copy.size, cudaMemcpyDeviceToDevice, after);
    }
    cudaGraphNode_t add_copy(void* to, const void* from, uint64_t size, cudaMemcpyKind kind,
                             const Nodes& after) {
        if (size <= (kind == cudaMemcpyHostToDevice ? kMaxReadByKernel : kMaxWrittenByKernel))
            return add(copy_call(to, from, size), after);
        cudaGraphNode_t node = nullptr;
        check(cudaGraphAddMemcpyNode1D(&node, graph_, after.data(), after.size(), to, from, size,
                                       kind),
              "cudaGraphAddMemcpyNode1D");
        return node;
    }

    const Limits& limits_;
    cudaGraph_t graph_ = nullptr;
};

}  // namespace

void allow_shared(const void* function, size_t shared, const Limits& limits) {
    if (shared == 0) return;
    cudaFuncAttributes attributes;
    check(cudaFuncGetAttributes(&attributes, function), "cudaFuncGetAttributes");
    if (shared + attributes.sharedSizeBytes <= kSharedOfAll) return;
    // All that the kernel may have, whatever it asks for now: the allowance is the kernel's, and
    // another thread may be asking for more.
    const int maximum =
        static_cast<int>(limits.shared_per_block) - static_cast<int>(attributes.sharedSizeBytes);
    check(cudaFuncSetAttribute(function, cudaFuncAttributeMaxDynamicSharedMemorySize, maximum),
          "cudaFuncSetAttribute");
}

void allow_cluster(const void* function) {
    check(cudaFuncSetAttribute(function, cudaFuncAttributeNonPortableClusterSizeAllowed, 1),
          "cudaFuncSetAttribute");
}

Graph::Graph(std::span<const Operation> operations, const Progress& progress,
             const Limits& limits) {
    Builder builder(limits);
    const std::vector<std::vector<size_t>> waits = dependencies(operations);
    std::vector<Nodes> last(operations.size());
    std::vector<bool> waited_for(operations.size());
    for (size_t i = 0; i < operations.size(); ++i) {
        Nodes after;
        for (const size_t j : waits[i]) {
            add_new(after, last[j]);
            waited_for[j] = true;
        }
        const auto early = [&](const Node& node) {
            Nodes before;
            for (const size_t j : early_dependencies(operations, i, node)) add_new(before, last[j]);
            return before;
        };
        last[i] = builder.add(operations[i], after, early);
        if (last[i].empty()) last[i] = after;  // a run that records nothing
    }
    Nodes ends;
    for (size_t i = 0; i < operations.size(); ++i)
        if (!waited_for[i]) add_new(ends, last[i]);
    builder.add(publish_call(progress), ends);
    check(cudaGraphInstantiate(&executable_, builder.graph(), 0), "cudaGraphInstantiate");
}

Graph::~Graph() { cudaGraphExecDestroy(executable_); }

void Graph::launch(cudaStream_t stream) {
    check(cudaGraphLaunch(executable_, stream), "cudaGraphLaunch");
}

}  // namespace defrec::cuda
