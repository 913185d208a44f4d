// A node of ROS 2 as far as DDS can tell, of another vendor than tfdude-ros. It does what the lines
// of a file, or a FIFO, say, and ends with it:
//   peer DOMAIN COMMANDS
//   listen TOPIC KIND PROFILE         prints each message, as a line that begins with the topic
//   advertise TOPIC KIND PROFILE      prints "matched TOPIC" once a reader is found
//   publish TOPIC MESSAGE             STAMP may be NOW
//   every HZ TIMES TOPIC MESSAGE      publishes it so often
//   forget TOPIC                      deletes its writer
//   wait SECONDS
// PROFILE: reliable, latched, or best_effort. peer.h describes KIND and MESSAGE.

#include "peer.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
  char* topic;
  const Kind* kind;
  dds_entity_t writer;
} Advertised;

static dds_entity_t participant;
static Advertised advertised[16];
static pthread_mutex_t printing = PTHREAD_MUTEX_INITIALIZER;

static dds_entity_t checked(dds_entity_t result, const char* what) {
  if (result >= 0) return result;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(-result));
  exit(1);
}

static void* not_null(void* found, const char* what) {
  if (found != NULL) return found;
  fprintf(stderr, "unknown: %s\n", what);
  exit(1);
}

static dds_entity_t topic_of(const char* name, const Kind* kind) {
  char dds_name[300];
  snprintf(dds_name, sizeof dds_name, "rt%s", name);
  return checked(dds_create_topic(participant, kind->type, dds_name, NULL, NULL), name);
}

// As rmw_cyclonedds asks for them: plain CDR of XCDR1.
static dds_qos_t* profile_of(const char* name, int depth) {
  dds_qos_t* qos = dds_create_qos();
  const bool best_effort = strcmp(name, "best_effort") == 0;
  dds_qset_reliability(qos, best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
                       DDS_SECS(1));
  dds_qset_durability(
      qos, strcmp(name, "latched") == 0 ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  dds_qset_data_representation(qos, 1,
                               (dds_data_representation_id_t[]){DDS_DATA_REPRESENTATION_XCDR1});
  return qos;
}

typedef struct {
  char* topic;
  const Kind* kind;
} Listening;

static void on_data(dds_entity_t reader, void* argument) {
  const Listening* listening = argument;
  void* samples[100] = {NULL};
  dds_sample_info_t infos[100];
  int count;
  while ((count = dds_take(reader, samples, infos, 100, 100)) > 0) {
    pthread_mutex_lock(&printing);
    for (int i = 0; i < count; ++i) {
      if (infos[i].valid_data) listening->kind->print(listening->topic, samples[i]);
    }
    fflush(stdout);
    pthread_mutex_unlock(&printing);
    dds_return_loan(reader, samples, count);
  }
}

static void listen(char* topic, const char* kind, const char* profile) {
  Listening* listening = malloc(sizeof *listening);
  listening->topic = strdup(topic);
  listening->kind = not_null((void*)find_kind(kind), kind);
  dds_listener_t* listener = dds_create_listener(listening);
  dds_lset_data_available(listener, on_data);
  dds_qos_t* qos = profile_of(profile, 100);
  checked(dds_create_reader(participant, topic_of(topic, listening->kind), qos, listener), topic);
  dds_delete_qos(qos);
  dds_delete_listener(listener);
}

static void print_matched(dds_entity_t writer, dds_publication_matched_status_t status,
                          void* topic) {
  (void)writer;
  if (status.current_count_change <= 0) return;
  pthread_mutex_lock(&printing);
  printf("matched %s\n", (const char*)topic);
  fflush(stdout);
  pthread_mutex_unlock(&printing);
}

static Advertised* find(const char* topic) {
  for (size_t i = 0; i < sizeof advertised / sizeof advertised[0]; ++i) {
    if (advertised[i].topic != NULL && strcmp(advertised[i].topic, topic) == 0) {
      return &advertised[i];
    }
  }
  return NULL;
}

static void advertise(char* topic, const char* kind, const char* profile) {
  Advertised* slot = advertised;
  while (slot->topic != NULL) ++slot;
  slot->topic = strdup(topic);
  slot->kind = not_null((void*)find_kind(kind), kind);
  dds_listener_t* listener = dds_create_listener(slot->topic);
  dds_lset_publication_matched(listener, print_matched);
  // Each message of a latched topic replaces the one before.
  dds_qos_t* qos = profile_of(profile, strcmp(profile, "latched") == 0 ? 1 : 100);
  slot->writer =
      checked(dds_create_writer(participant, topic_of(topic, slot->kind), qos, listener), topic);
  dds_delete_qos(qos);
  dds_delete_listener(listener);
}

static void publish(const char* topic, const char* text) {
  const Advertised* one = not_null(find(topic), topic);
  char* message = malloc(strlen(text) + 30);
  if (strncmp(text, "NOW", 3) == 0) {
    sprintf(message, "%lld%s", (long long)dds_time(), text + 3);
  } else {
    strcpy(message, text);
  }
  checked(dds_write(one->writer, one->kind->parse(message)), topic);
}

static void every(double rate, int times, const char* topic, const char* text) {
  const dds_time_t begin = dds_time();
  for (int i = 0; i < times; ++i) {
    const dds_time_t due = begin + (dds_time_t)(i * 1e9 / rate);
    if (dds_time() < due) dds_sleepfor(due - dds_time());
    publish(topic, text);
  }
}

static void forget(const char* topic) {
  Advertised* one = not_null(find(topic), topic);
  checked(dds_delete(one->writer), topic);
  one->topic = NULL;
}

static void obey(char* line) {
  char* rest = line;
  const char* command = strsep(&rest, " ");
  if (strcmp(command, "wait") == 0) {
    dds_sleepfor((dds_duration_t)(atof(rest) * 1e9));
    return;
  }
  if (strcmp(command, "every") == 0) {
    const double rate = atof(strsep(&rest, " "));
    const int times = atoi(strsep(&rest, " "));
    const char* topic = strsep(&rest, " ");
    every(rate, times, topic, rest);
    return;
  }
  char* topic = not_null(strsep(&rest, " "), command);
  if (strcmp(command, "publish") == 0) {
    publish(topic, rest);
  } else if (strcmp(command, "forget") == 0) {
    forget(topic);
  } else {
    const char* kind = not_null(strsep(&rest, " "), command);
    const char* profile = not_null(rest, command);
    if (strcmp(command, "listen") == 0) {
      listen(topic, kind, profile);
    } else if (strcmp(command, "advertise") == 0) {
      advertise(topic, kind, profile);
    } else {
      not_null(NULL, command);
    }
  }
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fputs("usage: peer DOMAIN COMMANDS\n", stderr);
    return 2;
  }
  participant = checked(
      dds_create_participant((dds_domainid_t)strtoul(argv[1], NULL, 10), NULL, NULL), "domain");
  FILE* commands = not_null(fopen(argv[2], "r"), argv[2]);
  char* line = NULL;
  size_t size = 0;
  ssize_t length;
  while ((length = getline(&line, &size, commands)) > 0) {
    if (line[length - 1] == '\n') line[length - 1] = 0;
    if (*line != 0 && *line != '#') obey(line);
  }
  checked(dds_delete(participant), "end");
  return 0;
}
