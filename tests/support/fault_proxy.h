// A bad line between two programs on this machine.
//
// Accepts connections on loopback and carries bytes to a target and back, as badly as it is told:
// late, slowly, not at all, with wrong bits, or until it cuts. Settings hold for bytes that arrive
// from then on, of connections that exist too.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <string>
#include <thread>

namespace lucerna {

class FaultProxy {
 public:
  // `target` is "127.0.0.1:port".
  explicit FaultProxy(const std::string& target);
  ~FaultProxy();
  FaultProxy(const FaultProxy&) = delete;
  FaultProxy& operator=(const FaultProxy&) = delete;

  // "127.0.0.1:port".
  [[nodiscard]] const std::string& address() const { return address_; }

  // Each way.
  void SetDelay(std::chrono::milliseconds delay) { delay_ms_ = delay.count(); }
  // Of each connection and each way; 0: as fast as it goes.
  void SetRate(std::int64_t bytes_per_s) { bytes_per_s_ = bytes_per_s; }
  // Takes bytes and carries none on: half-open connections, which nobody is told of.
  void SetSwallow(bool swallows) { swallows_ = swallows; }
  // Flips a bit of every so many bytes; 0: of none.
  void SetFlipEvery(std::int64_t bytes) { flip_every_ = bytes; }
  // Closes all connections there are.
  void Cut();

  [[nodiscard]] int connections() const { return connections_; }  // so far
  [[nodiscard]] std::int64_t bytes() const { return bytes_; }     // carried so far, both ways
  [[nodiscard]] std::int64_t flips() const { return flips_; }

 private:
  struct Connection {
    int client = -1, server = -1;
    std::thread there, back;
  };
  void Accept();
  // Carries bytes until either end closes.
  void Carry(int from, int to);

  std::string address_;
  int target_port_ = 0;
  int listener_ = -1;
  std::atomic<bool> is_ending_ = false;
  std::atomic<std::int64_t> delay_ms_ = 0, bytes_per_s_ = 0, flip_every_ = 0, bytes_ = 0,
                            flips_ = 0;
  std::atomic<bool> swallows_ = false;
  std::atomic<int> connections_ = 0;
  std::mutex mutex_;
  std::list<Connection> open_;  // guarded by mutex_
  std::thread accepting_;       // last: it uses all of the above
};

}  // namespace lucerna
