//! Choice of the adapter.

use wgpu::{Adapter, AdapterInfo, Backends, DeviceType, Features, Instance, InstanceDescriptor, InstanceFlags, Limits};

use super::super::{AdapterSummary, BackendError, Precision};

/// The adapters that may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Hardware only.
    Hardware,
    /// Hardware first, otherwise a software adapter.
    Any,
}

/// The system's adapters that can run the kernels, the preferred one first.
///
/// - `arithmetic`: the number type in which an adapter corrects displacements
pub(super) fn adapters(arithmetic: impl Fn(&Adapter) -> Precision) -> Vec<AdapterSummary> {
    let adapters = usable();
    let summary = |(place, adapter): (usize, &Adapter)| {
        let info = adapter.get_info();
        AdapterSummary {
            kind: match info.device_type {
                DeviceType::DiscreteGpu => "discrete GPU",
                DeviceType::IntegratedGpu => "integrated GPU",
                DeviceType::VirtualGpu => "virtual GPU",
                DeviceType::Cpu => "software",
                DeviceType::Other => "other",
            },
            driver: driver(&info),
            api: info.backend.to_string(),
            max_array_bytes: max_binding(&adapter.limits()),
            arithmetic: arithmetic(adapter),
            auto: place == 0 && is_hardware(&info),
            name: info.name,
        }
    };
    adapters.iter().enumerate().map(summary).collect()
}

/// The adapter to use.
///
/// # Errors
/// [`BackendError::NoAdapter`]
pub(super) fn choose(choice: Choice) -> Result<Adapter, BackendError> {
    let best = usable().into_iter().next();
    match choice {
        Choice::Hardware => best.filter(|adapter| is_hardware(&adapter.get_info())),
        Choice::Any => best,
    }
    .ok_or_else(|| {
        BackendError::NoAdapter(
            "install the GPU's Vulkan driver, or for a software adapter Mesa's lavapipe \
             (Debian, Ubuntu: apt-get install mesa-vulkan-drivers)"
                .to_owned(),
        )
    })
}

/// Driver name and version.
pub(super) fn driver(info: &AdapterInfo) -> String {
    format!("{} {}", info.driver, info.driver_info).trim().to_owned()
}

/// The feature of numbers in f64 if the adapter has it, otherwise none.
pub(super) fn double(adapter: &Adapter) -> Features {
    adapter.features() & Features::SHADER_F64
}

/// The feature of time stamps if the adapter has it, otherwise none.
pub(super) fn times(adapter: &Adapter) -> Features {
    adapter.features() & Features::TIMESTAMP_QUERY
}

/// Most bytes of one array.
pub(super) fn max_binding(limits: &Limits) -> u64 {
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// The limits that the kernels need: WebGPU's defaults, and the adapter's own limits for the size
/// of an array.
pub(super) fn required_limits(adapter: &Adapter) -> Limits {
    let limits = adapter.limits();
    Limits {
        max_storage_buffer_binding_size: limits.max_storage_buffer_binding_size,
        max_buffer_size: limits.max_buffer_size,
        ..Limits::defaults()
    }
}

fn usable() -> Vec<Adapter> {
    // No flags: validation layers would make debug builds depend on other installed software.
    let instance = Instance::new(InstanceDescriptor {
        flags: InstanceFlags::empty(),
        ..InstanceDescriptor::new_without_display_handle()
    });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(Backends::PRIMARY));
    adapters.retain(|adapter| required_limits(adapter).check_limits(&adapter.limits()));
    // On Windows a card is there twice, and has f64 through Vulkan alone. The sort is stable, so
    // equal adapters keep the system's order.
    adapters.sort_by_key(|adapter| {
        let of_kind = match adapter.get_info().device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other => 3,
            DeviceType::Cpu => 4,
        };
        (of_kind, double(adapter).is_empty())
    });
    adapters
}

fn is_hardware(info: &AdapterInfo) -> bool {
    matches!(info.device_type, DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu)
}
