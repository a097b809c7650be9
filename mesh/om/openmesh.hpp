// mesh/om/openmesh.hpp: a guard for calls of OpenMesh. OpenMesh's readers and writers are singletons with
// state, and print to std::cerr. While a call_guard exists, no other thread is inside OpenMesh and nothing is
// printed.
#ifndef FCT_MESH_OPENMESH_HPP
#define FCT_MESH_OPENMESH_HPP

#include <mutex>

#include <OpenMesh/Core/System/omstream.hh>

namespace fct_openmesh {

inline std::mutex one_at_a_time;

class call_guard {
  public:
    call_guard() : lock(one_at_a_time) {
        for (int i = 0; i < 3; ++i) {
            was_enabled[i] = stream(i).is_enabled();
            stream(i).disable();
        }
    }
    ~call_guard() {
        for (int i = 0; i < 3; ++i)
            if (was_enabled[i]) stream(i).enable();
    }
    call_guard(const call_guard &) = delete;
    call_guard &operator=(const call_guard &) = delete;

  private:
    static OpenMesh::mostream &stream(int i) { return i == 0 ? ::omerr() : i == 1 ? ::omlog() : ::omout(); }
    std::lock_guard<std::mutex> lock;
    bool was_enabled[3];
};

} // namespace fct_openmesh

#endif
