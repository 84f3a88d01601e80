// What does OpenSSL do when the process ends?
//
// By itself it frees all that it has. A thread of gRPC that is within a handshake then, of a
// connection that nobody waits for any more, would use what is gone.
#pragma once

namespace lucerna {

// From now on OpenSSL stays until the process has ended. Before it is used otherwise.
void KeepOpenSsl();

}  // namespace lucerna
