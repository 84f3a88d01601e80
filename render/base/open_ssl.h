// What does OpenSSL do when the process ends?
//
// By default it frees its memory at exit. A thread of gRPC may be within a handshake then, of a
// connection that has been given up, and would use memory that was freed.
#pragma once

namespace lucerna {

// From now on OpenSSL stays until the process has ended. Before it is used otherwise.
void KeepOpenSsl();

}  // namespace lucerna
