/* Serial ports of this machine: found by name, by the serial number of a USB
 * adapter or by where it is plugged in, opened through libserialport, held for
 * this process alone, and opened again when they vanish and come back.
 * Pseudo-terminals, which libserialport refuses, are opened by serial.h. */
#ifndef TRANSPORT_DRIVERS_SERIAL_PORT_H
#define TRANSPORT_DRIVERS_SERIAL_PORT_H

#include "serial.h"

enum { SERIAL_NAME_MAX = 128, SERIAL_LOOK_US = 500000 };

struct serial_port_settings {
    /* "/dev/ttyUSB0", or a link to it, which is followed each time that the
     * port is opened; "usb:NUMBER", the adapter's serial number; "at:1-1.3",
     * its bus and the ports on the way to it, as /sys names them. */
    char name[SERIAL_NAME_MAX];
    uint32_t baud; /* any rate that the port can; 0: as it is */
    bool rts_cts;  /* hardware flow control */
    /* Levels of the modem lines while the port is open.  Opening raises both,
     * so that true makes no edge after it, nor does closing. */
    bool dtr, rts;
};

struct serial_port {
    struct serial_pipe pipe;
    struct serial_port_settings settings;
    char device[SERIAL_NAME_MAX]; /* that it is or was */
    char fault[384];              /* why it is not open, for the user */
    uint64_t look_us;             /* when it was last looked for */
    unsigned returned;            /* times that it came back */
};

/* 0, or -1 and port->fault.  The port can be used as a pipe in either case: it
 * is closed until the port is there. */
int serial_port_open(struct serial_port *port,
                     const struct serial_port_settings *settings);
void serial_port_close(struct serial_port *port);

/* Raises or lowers RTS, else DTR, of a port that is open: 0, or -1 and errno;
 * ENODEV: it is not. */
int serial_port_set(const struct serial_port *port, bool rts, bool high);

#endif
